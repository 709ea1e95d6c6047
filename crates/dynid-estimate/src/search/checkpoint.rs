//! State of a run, to be saved and resumed.

use thiserror::Error;

/// State of a run after a whole iteration: plain numbers, for any file format.
///
/// [`resume`](super::resume) continues with the same bits as if the run had never been interrupted. All real numbers are
/// in `words` as their bits, so infinities and last digits survive formats that lose them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Checkpoint {
    /// The algorithm with all its parameters and the population, as text; compared on resuming.
    pub algorithm: String,
    /// The seed of the run.
    pub seed: u64,
    /// Bounds, position in the random stream, counters, best point, history and the state of the algorithm.
    pub words: Vec<u64>,
}

/// Why a checkpoint is refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CheckpointError {
    /// Saved by another algorithm, with other parameters or another population.
    #[error("the checkpoint is of {found}, expected {expected}")]
    Algorithm {
        /// The algorithm to be resumed.
        expected: String,
        /// The algorithm of the checkpoint.
        found: String,
    },
    /// Saved with other bounds.
    #[error("the checkpoint is of a search within other bounds")]
    Bounds,
    /// Saved with another seed.
    #[error("the checkpoint is of seed {found}, expected {expected}")]
    Seed {
        /// The seed of the settings.
        expected: u64,
        /// The seed of the checkpoint.
        found: u64,
    },
    /// Too few or too many numbers, or numbers that cannot be a state.
    #[error("the checkpoint is damaged: its numbers are no state of this algorithm")]
    Damaged,
}

/// Carries fields into a checkpoint or out of it, in the same order both ways.
pub(super) enum Transfer<'a> {
    Save(&'a mut Vec<u64>),
    Load { words: &'a [u64], damaged: bool },
}

impl Transfer<'_> {
    pub(super) fn integer(&mut self, value: &mut u64) {
        match self {
            Transfer::Save(out) => out.push(*value),
            Transfer::Load { words, damaged } => match words.split_first() {
                Some((first, rest)) => (*value, *words) = (*first, rest),
                None => *damaged = true,
            },
        }
    }

    /// An index or count; damaged if it does not stay below `limit`.
    pub(super) fn count(&mut self, value: &mut usize, limit: usize) {
        let mut wide = *value as u64;
        self.integer(&mut wide);
        match usize::try_from(wide) {
            Ok(found) if found < limit => *value = found,
            _ => self.fail(),
        }
    }

    pub(super) fn flag(&mut self, value: &mut bool) {
        let mut count = usize::from(*value);
        self.count(&mut count, 2);
        *value = count == 1;
    }

    pub(super) fn real(&mut self, value: &mut f64) {
        let mut bits = value.to_bits();
        self.integer(&mut bits);
        *value = f64::from_bits(bits);
    }

    /// Numbers whose count is known beforehand.
    pub(super) fn reals(&mut self, values: &mut [f64]) {
        values.iter_mut().for_each(|value| self.real(value));
    }

    /// Numbers whose count is part of the state, a multiple of `unit`.
    pub(super) fn list(&mut self, values: &mut Vec<f64>, unit: usize) {
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

    pub(super) fn fail(&mut self) {
        if let Transfer::Load { damaged, .. } = self {
            *damaged = true;
        }
    }

    /// Whether loading went well and used every number.
    pub(super) fn complete(&self) -> bool {
        match self {
            Transfer::Save(_) => true,
            Transfer::Load { words, damaged } => words.is_empty() && !damaged,
        }
    }
}
