//! Numbers as bytes.

use std::io::Read;

use super::arrays::Values;

/// How a number is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Half,
    Single,
    Double,
    /// Bytes of a number.
    Signed(usize),
    /// Bytes of a number.
    Unsigned(usize),
    Bool,
}

/// Numbers of one kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Numbers {
    pub(super) kind: Kind,
    pub(super) big_endian: bool,
}

impl Numbers {
    /// Bytes of a number.
    pub(super) fn size(self) -> usize {
        match self.kind {
            Kind::Half => 2,
            Kind::Single => 4,
            Kind::Double => 8,
            Kind::Signed(n) | Kind::Unsigned(n) => n,
            Kind::Bool => 1,
        }
    }

    /// Reads so many numbers.
    ///
    /// # Errors
    /// There are fewer.
    pub(super) fn read(self, file: &mut impl Read, count: usize) -> Result<Values, String> {
        let size = self.size();
        let wanted = count.checked_mul(size).ok_or("expected a shape that fits memory")?;
        // What a header promises is taken only as it arrives.
        let mut bytes = Vec::new();
        file.take(wanted as u64).read_to_end(&mut bytes).map_err(|e| e.to_string())?;
        if bytes.len() < wanted {
            return Err(format!("expected {wanted} bytes of numbers, found {}", bytes.len()));
        }
        let word = |chunk: &[u8]| {
            let mut word = [0; 8];
            for (k, byte) in chunk.iter().enumerate() {
                word[if self.big_endian { chunk.len() - 1 - k } else { k }] = *byte;
            }
            u64::from_le_bytes(word)
        };
        let words = bytes.chunks_exact(size).map(word);
        Ok(match self.kind {
            Kind::Half => Values::Float(words.map(|w| half(w as u16)).collect()),
            Kind::Single => Values::Float(words.map(|w| f64::from(f32::from_bits(w as u32))).collect()),
            Kind::Double => Values::Float(words.map(f64::from_bits).collect()),
            Kind::Unsigned(_) | Kind::Bool => match words.clone().map(i64::try_from).collect() {
                Ok(whole) => Values::Whole(whole),
                Err(_) => Values::Float(words.map(|w| w as f64).collect()),
            },
            Kind::Signed(n) => {
                let shift = 64 - 8 * n as u32;
                Values::Whole(words.map(|w| ((w << shift) as i64) >> shift).collect())
            }
        })
    }
}

/// The number of IEEE 754 half precision with these bits.
fn half(bits: u16) -> f64 {
    let (exponent, fraction) = (i32::from(bits >> 10 & 0x1f), f64::from(bits & 0x3ff));
    let size = match exponent {
        0 => fraction * 2f64.powi(-24),
        31 if fraction == 0.0 => f64::INFINITY,
        31 => f64::NAN,
        _ => (1024.0 + fraction) * 2f64.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_exact() {
        assert_eq!(
            [0x3c00, 0xc000, 0x3555, 0x0001].map(half),
            [1.0, -2.0, 0.333_251_953_125, 2f64.powi(-24)]
        );
    }
}
