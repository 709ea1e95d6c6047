//! What can go wrong.

use thiserror::Error;

/// Why a report could not be made.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A list does not have one entry per joint, or a series not one entry per sample.
    #[error("{place}: {found} entries, expected {expected}")]
    Length {
        /// Where, e.g. `log "train", joint "joint_1", predicted effort`.
        place: String,
        /// Entries it should have.
        expected: usize,
        /// Entries it has.
        found: usize,
    },
    /// A count contradicts the list that it counts.
    #[error("{place}: the count says {stated}, the list has {found}")]
    Count {
        /// Which count, e.g. `base parameters`.
        place: String,
        /// What the count says.
        stated: u64,
        /// Entries of the list.
        found: u64,
    },
    /// The time of a log is not finite or runs backwards.
    #[error("{place}: time of sample {sample} is {found} s, expected a finite number not below {least} s")]
    Time {
        /// Where, e.g. `log "train"`.
        place: String,
        /// Index of the sample, from 0.
        sample: usize,
        /// Time before it, s; minus infinity for the first sample.
        least: f64,
        /// Time found, s.
        found: f64,
    },
    /// The recorded part of a trajectory is not a stretch of time.
    #[error("recorded part: {found:?} s, expected a finite start not behind its end")]
    Recorded {
        /// Start and end, s.
        found: [f64; 2],
    },
    /// The page could not be laid out.
    #[error("the report's page could not be laid out")]
    Template(#[from] minijinja::Error),
    /// A plot's data could not be written.
    #[error("the data of a plot could not be written")]
    Encode(#[from] serde_json::Error),
}
