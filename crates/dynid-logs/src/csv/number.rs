//! Decimal text to `f64`, correctly rounded.

/// Powers of ten that are exact in `f64`.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// The number at the start of `text` and its length; `None` if none stands there or it is not finite.
///
/// The value is the one that `str::parse` gives. Short numbers, which logs are full of, take the exact path of Clinger
/// (1990): an integer below 2^53 times or over a power of ten up to 10^22 rounds once.
#[inline]
pub(crate) fn prefix(text: &[u8]) -> Option<(f64, usize)> {
    let mut at = 0;
    let negative = text.first() == Some(&b'-');
    if negative || text.first() == Some(&b'+') {
        at = 1;
    }
    let mut mantissa: u64 = 0;
    let start = at;
    while let Some(digit) = digit(text, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    let mut digits = at - start;
    let mut exponent: i64 = 0;
    if text.get(at) == Some(&b'.') {
        at += 1;
        let fraction = at;
        while let Some(digit) = digit(text, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        digits += at - fraction;
        exponent = -((at - fraction) as i64);
    }
    if digits == 0 {
        return None;
    }
    if let Some(b'e' | b'E') = text.get(at) {
        let sign = text.get(at + 1);
        let mut k = at + 1 + usize::from(matches!(sign, Some(b'+' | b'-')));
        let first = k;
        let mut value: i64 = 0;
        while let Some(digit) = digit(text, k) {
            value = (10 * value + digit as i64).min(100_000);
            k += 1;
        }
        if k == first {
            return None;
        }
        exponent += if sign == Some(&b'-') { -value } else { value };
        at = k;
    }
    // Nineteen digits fit a u64, so the mantissa has not wrapped.
    let exact = digits <= 19 && mantissa <= 1 << 53 && (-22..=22).contains(&exponent);
    if !exact {
        let token = std::str::from_utf8(&text[..at]).ok()?;
        return token.parse::<f64>().ok().filter(|x| x.is_finite()).map(|x| (x, at));
    }
    let power = EXACT_POWERS[exponent.unsigned_abs() as usize];
    let magnitude = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    Some((if negative { -magnitude } else { magnitude }, at))
}

/// The numbers of a row that holds nothing else, as many as `values`, none beyond `largest`; `false`: look closer.
#[inline]
pub(crate) fn row(line: &[u8], separator: u8, values: &mut [f64], largest: &[f64]) -> bool {
    let mut at = 0;
    let last = values.len() - 1;
    for (k, (x, largest)) in values.iter_mut().zip(largest).enumerate() {
        while line.get(at) == Some(&b' ') {
            at += 1;
        }
        let Some((value, length)) = prefix(&line[at..]) else { return false };
        if value.abs() > *largest {
            return false;
        }
        *x = value;
        at += length;
        while line.get(at) == Some(&b' ') {
            at += 1;
        }
        match line.get(at) {
            Some(b) if *b == separator && k < last => at += 1,
            None if k == last => {}
            _ => return false,
        }
    }
    true
}

/// The whole part of a plain decimal number such as `1700000000123456789` or `1700000000.25`; `None` with an exponent, and
/// beyond the range.
pub(crate) fn whole_part(text: &[u8]) -> Option<i64> {
    let whole = match text.iter().position(|b| *b == b'.') {
        Some(point) if text[point + 1..].iter().all(u8::is_ascii_digit) => &text[..point],
        Some(_) => return None,
        None => text,
    };
    std::str::from_utf8(whole).ok()?.parse().ok()
}

/// A plain decimal number minus a whole number: the difference of the whole parts is exact, so that no digit of a stamp since
/// 1970 is lost.
pub(crate) fn beyond(text: &[u8], origin: i64) -> Option<f64> {
    let whole = whole_part(text)?;
    let fraction = match text.iter().position(|b| *b == b'.') {
        Some(point) if point + 1 < text.len() => {
            let (value, length) = prefix(&text[point..])?;
            (point + length == text.len()).then_some(value)?
        }
        _ => 0.0,
    };
    let fraction = if text.first() == Some(&b'-') { -fraction } else { fraction };
    Some(whole.checked_sub(origin)? as f64 + fraction)
}

#[inline(always)]
fn digit(text: &[u8], at: usize) -> Option<u64> {
    let digit = text.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

#[cfg(test)]
mod tests {
    use super::prefix;

    #[track_caller]
    fn check(text: &str) {
        let expected = text.parse::<f64>().ok().filter(|x| x.is_finite());
        let found = prefix(text.as_bytes()).filter(|(_, n)| *n == text.len()).map(|(x, _)| x);
        assert_eq!(found.map(f64::to_bits), expected.map(f64::to_bits), "{text}");
    }

    #[test]
    fn agrees_with_the_standard_library_to_the_bit() {
        for text in [
            "0",
            "-0",
            "+1",
            "1.",
            ".5",
            "-.5e-3",
            "1e5",
            "1E+5",
            "9007199254740993",
            "9007199254740992",
            "0.1234567890123456789",
            "123456789012345678901234567890",
            "1e22",
            "1e23",
            "1e-22",
            "1e-23",
            "1e308",
            "1e309",
            "-1e400",
            "5e-324",
            "1e-400",
            "0.000000000000000000001",
            "00000000000000000000001.5",
            ".",
            "",
            "-",
            "e5",
            "1e",
            "1e+",
            "nan",
            "inf",
            "1.5e99999999999999999999",
            "1,5",
            "0x10",
            "1_000",
            "1.2.3",
        ] {
            check(text);
        }
        // A multiplicative congruential sequence (Lehmer 1951), so that the test needs no generator crate.
        let mut state: u64 = 0x9E37_79B9_7F4A_7C15;
        for _ in 0..200_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let x = f64::from_bits(state);
            let y = (state >> 11) as f64 / (1u64 << 50) as f64 - 4.0;
            for text in [format!("{x:e}"), format!("{y}"), format!("{y:.6}"), format!("{y:.9e}")] {
                check(&text);
            }
        }
    }
}
