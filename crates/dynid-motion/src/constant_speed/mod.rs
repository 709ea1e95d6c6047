//! Constant-speed passes of a joint, and what a forward and a backward one say together.
//!
//! [`segments()`] finds where a joint moves at constant speed. At constant speed the effort is gravity, offset and friction;
//! at one position gravity and offset are the same both ways, so that [`pair`] tells them apart: half the difference of
//! both directions is friction, half their sum gravity and offset. With one direction alone they cannot be told apart,
//! and the passes are returned with that reason.

mod pairs;
mod segments;
mod speed;

pub use pairs::{PairSettings, Pairing, Pass, PassSummary, SpeedPoint, Unpaired, UnpairedReason, pair};
pub use segments::{Segment, SegmentSettings, at_rest, segments};
pub use speed::speed;

use crate::signal::SignalError;

/// Why constant-speed passes cannot be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConstantSpeedError {
    /// A signal is refused.
    #[error(transparent)]
    Signal(#[from] SignalError),
    /// Time does not advance.
    #[error("time of sample {sample}: expected more than {before} s, found {found} s")]
    Time {
        /// Index of the sample, from 0.
        sample: usize,
        /// Time before it, s.
        before: f64,
        /// Time of the sample, s.
        found: f64,
    },
}
