//! What an identification with load-dependent friction refuses.

use dynid_estimate::separable::SeparableError;
use dynid_search::BoundsError;
use thiserror::Error;

/// Why a record, a problem or a question to it is refused.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LoadFrictionError {
    /// No drives.
    #[error("a record without drives")]
    NoDrives,
    /// No drive has a sample in motion.
    #[error("no samples to fit: all of {samples} are at rest or left out")]
    NoSamples {
        /// Samples per drive.
        samples: usize,
    },
    /// A list or matrix of the wrong size.
    #[error("{what}: expected {expected}, found {found}")]
    Size {
        /// What was counted.
        what: String,
        /// Number that is expected.
        expected: usize,
        /// Number that is found.
        found: usize,
    },
    /// A number that is not finite.
    #[error("{what}, drive {drive}, sample {sample}: expected a finite number, found {found}")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// Drive, from 0.
        drive: usize,
        /// Sample, from 0.
        sample: usize,
        /// The value.
        found: f64,
    },
    /// A number out of its range.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// What it is.
        what: String,
        /// Range that is allowed.
        expected: &'static str,
        /// The value.
        found: f64,
    },
    /// Bounds that hold no interval.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// The nonlinear fit cannot run.
    #[error(transparent)]
    Fit(#[from] SeparableError),
    /// A singular value decomposition did not converge.
    #[error("the singular value decomposition of {what} did not converge")]
    Decomposition {
        /// Of which matrix.
        what: &'static str,
    },
    /// No parameters meet bounds and bodies together, whatever the data.
    #[error(
        "no parameters lie within the bounds and belong to bodies that can exist; nearest violation {violation} of the scales"
    )]
    Infeasible {
        /// Least violation, as a share of the scales of the parameters.
        violation: f64,
    },
}

pub(super) fn same_size(
    what: impl Into<String>,
    expected: usize,
    found: usize,
) -> Result<(), LoadFrictionError> {
    if expected == found {
        return Ok(());
    }
    Err(LoadFrictionError::Size { what: what.into(), expected, found })
}

pub(super) fn in_range(
    what: impl Into<String>,
    expected: &'static str,
    found: f64,
    good: bool,
) -> Result<(), LoadFrictionError> {
    if good {
        return Ok(());
    }
    Err(LoadFrictionError::Value { what: what.into(), expected, found })
}
