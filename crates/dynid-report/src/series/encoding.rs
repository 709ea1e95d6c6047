//! Numbers as base64 text: 2.7 characters for a value, about a third of its decimal digits.

use serde::Serialize;

/// Values of one series as little-endian 16-bit integers `q` in base64:
/// `value = low + (q + 32767) / 65534 * (high - low)`, and `q = -32768` where there is no value.
///
/// The step is 1/65534 of the series' range, far below a pixel.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct EncodedValues {
    low: f64,
    high: f64,
    data: String,
}

/// Times of one log as little-endian unsigned 32-bit integers `q` in base64:
/// `time = first + q / 4294967295 * (last - first)`, s.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct EncodedTimes {
    first: f64,
    last: f64,
    data: String,
}

pub(crate) fn encode_values(values: &[f64]) -> EncodedValues {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    let low = finite.clone().fold(f64::INFINITY, f64::min);
    let high = finite.fold(f64::NEG_INFINITY, f64::max);
    if low > high {
        let bytes: Vec<u8> = values.iter().flat_map(|_| i16::MIN.to_le_bytes()).collect();
        return EncodedValues { low: 0.0, high: 0.0, data: base64(&bytes) };
    }
    let quantise = |value: f64| {
        if !value.is_finite() {
            i16::MIN
        } else if high > low {
            // Halved first: the range of two huge values may overflow.
            let share = (value / 2.0 - low / 2.0) / (high / 2.0 - low / 2.0);
            (share * 65534.0 - 32767.0).round() as i16
        } else {
            -32767
        }
    };
    let bytes: Vec<u8> = values.iter().flat_map(|&value| quantise(value).to_le_bytes()).collect();
    EncodedValues { low, high, data: base64(&bytes) }
}

/// `times`: finite, not decreasing.
pub(crate) fn encode_times(times: &[f64]) -> EncodedTimes {
    let first = times.first().copied().unwrap_or(0.0);
    let last = times.last().copied().unwrap_or(0.0);
    let scale = if last > first { f64::from(u32::MAX) / (last - first) } else { 0.0 };
    let bytes: Vec<u8> =
        times.iter().flat_map(|&time| (((time - first) * scale).round() as u32).to_le_bytes()).collect();
    EncodedTimes { first, last, data: base64(&bytes) }
}

/// Base64 with padding (RFC 4648, section 4).
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for group in bytes.chunks(3) {
        let word =
            group.iter().enumerate().fold(0u32, |word, (i, &byte)| word | u32::from(byte) << (16 - 8 * i));
        for i in 0..4 {
            let letter = ALPHABET[(word >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= group.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_agrees_with_the_vectors_of_rfc_4648() {
        let vectors = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
        ];
        for (plain, encoded) in vectors {
            assert_eq!(base64(plain.as_bytes()), encoded);
        }
    }

    #[test]
    fn values_reach_both_ends_and_gaps_are_marked() {
        let encoded = encode_values(&[-2.0, 6.0, f64::NAN]);
        assert_eq!((encoded.low, encoded.high), (-2.0, 6.0));
        let expected: Vec<u8> = [-32767i16, 32767, -32768].iter().flat_map(|q| q.to_le_bytes()).collect();
        assert_eq!(encoded.data, base64(&expected));
    }

    #[test]
    fn constant_empty_and_missing_series_stay_finite() {
        for values in [vec![3.0; 4], vec![], vec![f64::NAN; 2], vec![-f64::MAX, f64::MAX]] {
            let encoded = encode_values(&values);
            assert!(encoded.low.is_finite() && encoded.high.is_finite());
        }
    }
}
