//! What may be wrong with settings, samples and saved states.

use core::fmt;

/// Why settings are refused.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SettingsError {
    /// A list has the wrong length.
    Length {
        /// Name of the list.
        what: &'static str,
        /// What it should have.
        expected: usize,
        /// What it has.
        found: usize,
    },
    /// A number is out of range.
    Number {
        /// Name of the number.
        what: &'static str,
        /// Place of the number in a list, 0 for single numbers.
        index: usize,
        /// What it should be.
        expected: &'static str,
        /// What it is.
        found: f64,
    },
    /// Two settings that exclude each other.
    Combination {
        /// Which, and why.
        what: &'static str,
    },
}

impl fmt::Display for SettingsError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { what, expected, found } => {
                write!(f, "{what}: expected {expected} entries, found {found}")
            }
            Self::Number { what, index, expected, found } => {
                write!(f, "{what} (entry {index}): expected {expected}, found {found}")
            }
            Self::Combination { what } => f.write_str(what),
        }
    }
}

impl core::error::Error for SettingsError {}

/// Why a sample is refused. The estimator is as it was before.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SampleError {
    /// A slice has the wrong length.
    Length {
        /// Name of the slice.
        what: &'static str,
        /// What it should have.
        expected: usize,
        /// What it has.
        found: usize,
    },
    /// More rows than the settings allow, or none.
    Rows {
        /// The most that the settings allow.
        most: usize,
        /// Rows of the sample.
        found: usize,
    },
    /// A number is not finite, or so large in units of its deviation that squares would overflow.
    NotFinite {
        /// Name of the number.
        what: &'static str,
        /// Place of the number in the slice.
        index: usize,
    },
    /// A deviation of a row's noise is not positive, or a covariance not positive definite.
    Noise {
        /// The row.
        row: usize,
    },
}

impl fmt::Display for SampleError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { what, expected, found } => {
                write!(f, "{what}: expected {expected} entries, found {found}")
            }
            Self::Rows { most, found } => write!(f, "rows of a sample: expected 1 to {most}, found {found}"),
            Self::NotFinite { what, index } => write!(f, "{what} (entry {index}): expected a finite number"),
            Self::Noise { row } => {
                write!(
                    f,
                    "noise of row {row}: expected a positive deviation or a positive definite covariance"
                )
            }
        }
    }
}

impl core::error::Error for SampleError {}

/// Why a saved state is refused. The estimator is as it was before.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum StateError {
    /// Saved by an estimator with other settings.
    OtherSettings,
    /// Too few or too many words, or words that cannot be a state.
    Damaged,
}

impl fmt::Display for StateError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OtherSettings => "the state is of an estimator with other settings",
            Self::Damaged => "the state is damaged: its words are no state of this estimator",
        })
    }
}

impl core::error::Error for StateError {}
