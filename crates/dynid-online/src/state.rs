//! State of an estimator as words of 64 bits.

use alloc::vec::Vec;

use crate::error::StateError;

/// Carries fields into words or out of them, in the same order both ways.
pub(crate) enum Transfer<'a> {
    Save(&'a mut Vec<u64>),
    Load { words: &'a [u64], fault: Option<StateError> },
}

impl<'a> Transfer<'a> {
    pub(crate) fn load(words: &'a [u64]) -> Self {
        Transfer::Load { words, fault: None }
    }

    fn integer(&mut self, value: &mut u64) {
        match self {
            Transfer::Save(out) => out.push(*value),
            Transfer::Load { words, fault } => match words.split_first() {
                Some((first, rest)) => (*value, *words) = (*first, rest),
                None => {
                    fault.get_or_insert(StateError::Damaged);
                }
            },
        }
    }

    /// A count that only grows; damaged beyond what any run reaches.
    pub(crate) fn counter(&mut self, value: &mut u64) {
        self.integer(value);
        if *value > 1 << 60 {
            self.fail();
        }
    }

    /// An index or count; damaged if it exceeds `largest`.
    pub(crate) fn count(&mut self, value: &mut usize, largest: usize) {
        let mut wide = *value as u64;
        self.integer(&mut wide);
        match usize::try_from(wide) {
            Ok(found) if found <= largest => *value = found,
            _ => self.fail(),
        }
    }

    pub(crate) fn flag(&mut self, value: &mut bool) {
        let mut count = usize::from(*value);
        self.count(&mut count, 1);
        *value = count == 1;
    }

    /// A finite number.
    pub(crate) fn real(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.integer(&mut bits);
        *value = f64::from_bits(bits);
        if !value.is_finite() {
            self.fail();
        }
    }

    /// Numbers whose count is known beforehand.
    pub(crate) fn reals(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.real(value));
    }

    /// Counts of which each is at most `largest`.
    pub(crate) fn counts(&mut self, values: &mut [usize], largest: usize) {
        values.iter_mut().for_each(|value| self.count(value, largest));
    }

    /// A word that must be the same on loading.
    pub(crate) fn fingerprint(&mut self, expected: u64) {
        let mut found = expected;
        self.integer(&mut found);
        if found != expected
            && let Transfer::Load { fault, .. } = self
        {
            fault.get_or_insert(StateError::OtherSettings);
        }
    }

    pub(crate) fn fail(&mut self) {
        if let Transfer::Load { fault, .. } = self {
            fault.get_or_insert(StateError::Damaged);
        }
    }

    /// Whether loading went well and used every word.
    pub(crate) fn finish(self) -> Result<(), StateError> {
        match self {
            Transfer::Load { fault: Some(fault), .. } => Err(fault),
            Transfer::Load { words, .. } if !words.is_empty() => Err(StateError::Damaged),
            _ => Ok(()),
        }
    }
}

/// FNV-1a over the bytes of words: tells settings apart.
pub(crate) struct Fingerprint(pub(crate) u64);

impl Fingerprint {
    pub(crate) fn new() -> Self {
        Fingerprint(0xcbf2_9ce4_8422_2325)
    }

    pub(crate) fn word(&mut self, word: u64) {
        for byte in word.to_le_bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
    }
}

impl core::fmt::Write for Fingerprint {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        text.bytes().for_each(|byte| self.word(u64::from(byte)));
        Ok(())
    }
}
