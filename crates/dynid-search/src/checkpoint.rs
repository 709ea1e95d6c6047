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
