//! States as words of 64 bits, for checkpoints in any file format. Without the standard library.

#![no_std]

extern crate alloc;

use alloc::vec::Vec;

/// Carries fields into a list of words or out of it, in the same order both ways.
///
/// Real numbers travel as their bits, so infinities and last digits survive formats that lose them.
#[derive(Debug)]
pub enum Transfer<'a> {
    /// Fields are appended.
    Save(&'a mut Vec<u64>),
    /// Fields are taken from the front.
    Load {
        /// What is left.
        words: &'a [u64],
        /// A word was missing or could not be.
        damaged: bool,
    },
}

impl<'a> Transfer<'a> {
    /// Reads fields from words.
    pub fn load(words: &'a [u64]) -> Self {
        Transfer::Load { words, damaged: false }
    }

    /// Any word.
    pub fn integer(&mut self, value: &mut u64) {
        match self {
            Transfer::Save(out) => out.push(*value),
            Transfer::Load { words, damaged } => match words.split_first() {
                Some((first, rest)) => (*value, *words) = (*first, rest),
                None => *damaged = true,
            },
        }
    }

    /// An index or count; damaged if it does not stay below `limit`.
    pub fn count(&mut self, value: &mut usize, limit: usize) {
        let mut wide = *value as u64;
        self.integer(&mut wide);
        match usize::try_from(wide) {
            Ok(found) if found < limit => *value = found,
            _ => self.fail(),
        }
    }

    /// Counts of which each stays below `limit`.
    pub fn counts(&mut self, values: &mut [usize], limit: usize) {
        values.iter_mut().for_each(|value| self.count(value, limit));
    }

    /// A count that only grows; damaged beyond what any run reaches.
    pub fn counter(&mut self, value: &mut u64) {
        self.integer(value);
        if *value > 1 << 60 {
            self.fail();
        }
    }

    /// Yes or no.
    pub fn flag(&mut self, value: &mut bool) {
        let mut count = usize::from(*value);
        self.count(&mut count, 2);
        *value = count == 1;
    }

    /// A real number.
    pub fn real(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.integer(&mut bits);
        *value = f64::from_bits(bits);
    }

    /// A real number that must be finite.
    pub fn finite(&mut self, value: &mut f64) {
        self.real(value);
        if !value.is_finite() {
            self.fail();
        }
    }

    /// Finite numbers whose count is known beforehand.
    pub fn finites(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.finite(value));
    }

    /// Numbers whose count is known beforehand.
    pub fn reals(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.real(value));
    }

    /// Numbers whose count is part of the state, a multiple of `unit`.
    pub fn list(&mut self, values: &mut Vec<f64>, unit: usize) {
        let mut length = values.len() as u64;
        self.integer(&mut length);
        if let Transfer::Load { words, damaged } = self {
            let fits = usize::try_from(length).ok().filter(|n| *n <= words.len() && n.is_multiple_of(unit));
            match fits {
                Some(n) => values.resize(n, 0.0),
                None => {
                    *damaged = true;
                    values.clear();
                }
            }
        }
        self.reals(values);
    }

    /// Says that what was loaded cannot be.
    pub fn fail(&mut self) {
        if let Transfer::Load { damaged, .. } = self {
            *damaged = true;
        }
    }

    /// Whether loading went well and used every number.
    pub fn complete(&self) -> bool {
        match self {
            Transfer::Save(_) => true,
            Transfer::Load { words, damaged } => words.is_empty() && !damaged,
        }
    }
}
