//! Messages as bytes: CDR of ROS 2, and the plain order of ROS 1.

use super::definition::Primitive;

/// Reads values one behind the other.
pub(super) struct Wire<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
    /// Values stand at multiples of their size, counted from behind the four bytes that begin a message.
    aligned: bool,
}

/// The message ends before its values.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Short;

impl<'a> Wire<'a> {
    /// A message of ROS 2: four bytes tell how it was written.
    ///
    /// # Errors
    /// It was not written as plain CDR.
    pub(super) fn cdr(bytes: &'a [u8]) -> Result<Self, String> {
        match bytes {
            [0, kind @ (0 | 1), _, _, rest @ ..] => {
                Ok(Wire { bytes: rest, at: 0, big_endian: *kind == 0, aligned: true })
            }
            [a, b, _, _, ..] => {
                Err(format!("expected a message in plain CDR, found the encapsulation {a:#04x} {b:#04x}"))
            }
            _ => Err("expected a message in CDR, found less than four bytes".to_owned()),
        }
    }

    /// A message of ROS 1.
    pub(super) fn ros1(bytes: &'a [u8]) -> Self {
        Wire { bytes, at: 0, big_endian: false, aligned: false }
    }

    pub(super) fn is_aligned(&self) -> bool {
        self.aligned
    }

    /// Bytes that were read.
    pub(super) fn place(&self) -> usize {
        self.at
    }

    fn align(&mut self, size: usize) {
        if self.aligned {
            self.at = self.at.next_multiple_of(size);
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Short> {
        let end = self.at.checked_add(count).ok_or(Short)?;
        let part = self.bytes.get(self.at..end).ok_or(Short)?;
        self.at = end;
        Ok(part)
    }

    fn word(&mut self, size: usize) -> Result<u64, Short> {
        self.align(size);
        let part = self.take(size)?;
        let mut word = [0; 8];
        if self.big_endian {
            word[8 - size..].copy_from_slice(part);
            return Ok(u64::from_be_bytes(word));
        }
        word[..size].copy_from_slice(part);
        Ok(u64::from_le_bytes(word))
    }

    /// Length of a sequence whose entries take at least one byte each.
    pub(super) fn length(&mut self) -> Result<usize, Short> {
        let length = self.word(4)? as usize;
        if length > self.bytes.len().saturating_sub(self.at) { Err(Short) } else { Ok(length) }
    }

    /// The bytes of a text, without the zero at the end that CDR has.
    pub(super) fn text(&mut self) -> Result<&'a [u8], Short> {
        let length = self.length()?;
        let text = self.take(length)?;
        Ok(if self.aligned { text.strip_suffix(&[0]).unwrap_or(text) } else { text })
    }

    /// A number; whole ones beyond 2^53 lose digits.
    pub(super) fn number(&mut self, primitive: Primitive) -> Result<f64, Short> {
        Ok(match primitive {
            Primitive::Bool | Primitive::U8 => self.word(1)? as f64,
            Primitive::I8 => f64::from(self.word(1)? as u8 as i8),
            Primitive::I16 => f64::from(self.word(2)? as u16 as i16),
            Primitive::U16 => self.word(2)? as f64,
            Primitive::I32 => f64::from(self.word(4)? as u32 as i32),
            Primitive::U32 => self.word(4)? as f64,
            Primitive::I64 => self.word(8)? as i64 as f64,
            Primitive::U64 => self.word(8)? as f64,
            Primitive::F32 => f64::from(f32::from_bits(self.word(4)? as u32)),
            Primitive::F64 => f64::from_bits(self.word(8)?),
            Primitive::Stamp { signed } => self.stamp(signed)? as f64 * 1e-9,
            Primitive::Text | Primitive::WideText => {
                self.skip(primitive, 1)?;
                f64::NAN
            }
        })
    }

    /// Seconds and nanoseconds, ns.
    pub(super) fn stamp(&mut self, signed: bool) -> Result<i64, Short> {
        let (seconds, rest) = (self.word(4)? as u32, self.word(4)? as u32);
        let (seconds, rest) = match signed {
            true => (i64::from(seconds as i32), i64::from(rest as i32)),
            false => (i64::from(seconds), i64::from(rest)),
        };
        Ok(seconds * 1_000_000_000 + rest)
    }

    /// Passes over values of one kind.
    pub(super) fn skip(&mut self, primitive: Primitive, count: usize) -> Result<(), Short> {
        let size = match primitive {
            Primitive::Text | Primitive::WideText => {
                for _ in 0..count {
                    // Characters of wide texts take two bytes on the wire of ROS 2.
                    let length = self.length()?;
                    self.take(if primitive == Primitive::WideText { 2 * length } else { length })?;
                }
                return Ok(());
            }
            Primitive::Bool | Primitive::U8 | Primitive::I8 => 1,
            Primitive::I16 | Primitive::U16 => 2,
            Primitive::I32 | Primitive::U32 | Primitive::F32 => 4,
            Primitive::I64 | Primitive::U64 | Primitive::F64 => 8,
            Primitive::Stamp { .. } => {
                self.align(4);
                return self.take(count.checked_mul(8).ok_or(Short)?).map(|_| ());
            }
        };
        if count > 0 {
            self.align(size);
            self.take(count.checked_mul(size).ok_or(Short)?)?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_stand_at_multiples_of_their_size_from_behind_the_first_four_bytes() {
        let mut bytes = vec![0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        bytes.extend(1.5f64.to_le_bytes());
        let mut wire = Wire::cdr(&bytes).unwrap();
        assert_eq!((wire.number(Primitive::U8), wire.number(Primitive::F64)), (Ok(7.0), Ok(1.5)));
        assert_eq!(wire.number(Primitive::U8), Err(Short));
        let mut big = vec![0, 0, 0, 0];
        big.extend((-5i32).to_be_bytes());
        assert_eq!(Wire::cdr(&big).unwrap().number(Primitive::I32), Ok(-5.0));
        assert!(Wire::cdr(&[0, 9, 0, 0]).is_err());
    }

    #[test]
    fn lengths_beyond_the_message_are_refused() {
        let bytes = [0, 1, 0, 0, 255, 255, 255, 127, 0];
        assert_eq!(Wire::cdr(&bytes).unwrap().text(), Err(Short));
        assert_eq!(Wire::ros1(&[3, 0, 0, 0, b'a', b'b', b'c']).text(), Ok(&b"abc"[..]));
    }
}
