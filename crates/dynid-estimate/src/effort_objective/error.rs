//! What an effort objective refuses.

use thiserror::Error;

use super::EffortLoss;

/// Why an objective cannot be formed.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum EffortObjectiveError {
    /// No samples.
    #[error("no samples")]
    NoSamples,
    /// A slice has the wrong length.
    #[error("{what}: {found}, expected {expected}")]
    Length {
        /// What was counted.
        what: &'static str,
        /// Number that is expected.
        expected: usize,
        /// Number that is found.
        found: usize,
    },
    /// A linear column that the model does not have, or that is listed twice.
    #[error("linear column {column} of {columns} is none of the model's or is listed twice")]
    Column {
        /// The column.
        column: usize,
        /// Number of columns of the model.
        columns: usize,
    },
    /// A weight or threshold out of its range.
    #[error("{what} of output {output} is {found}, expected {expected}")]
    Value {
        /// What it is.
        what: &'static str,
        /// Output, from 0.
        output: usize,
        /// Range that is allowed.
        expected: &'static str,
        /// Value that is found.
        found: f64,
    },
    /// A measured effort or an entry of the regressor that is not finite.
    #[error("{what} of output {output} is not finite at sample {sample}")]
    NotFinite {
        /// What it is.
        what: &'static str,
        /// Output, from 0.
        output: usize,
        /// Sample, from 0.
        sample: usize,
    },
}

pub(super) fn check_loss(loss: &EffortLoss, outputs: usize) -> Result<(), EffortObjectiveError> {
    let EffortLoss::Huber(thresholds) = loss else { return Ok(()) };
    if thresholds.len() != outputs {
        let (what, found) = ("thresholds", thresholds.len());
        return Err(EffortObjectiveError::Length { what, expected: outputs, found });
    }
    match thresholds.iter().position(|k| !(*k > 0.0 && k.is_finite())) {
        None => Ok(()),
        Some(output) => {
            let (what, expected) = ("threshold", "positive and finite");
            Err(EffortObjectiveError::Value { what, output, expected, found: thresholds[output] })
        }
    }
}

pub(super) fn check_efforts(
    effort: &[&[f64]],
    outputs: usize,
    samples: usize,
) -> Result<(), EffortObjectiveError> {
    if samples == 0 {
        return Err(EffortObjectiveError::NoSamples);
    }
    if effort.len() != outputs {
        let (what, found) = ("outputs with efforts", effort.len());
        return Err(EffortObjectiveError::Length { what, expected: outputs, found });
    }
    match effort.iter().find(|e| e.len() != samples) {
        None => Ok(()),
        Some(wrong) => {
            let what = "samples of effort";
            Err(EffortObjectiveError::Length { what, expected: samples, found: wrong.len() })
        }
    }
}
