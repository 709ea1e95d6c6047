//! What is to be designed: model, limits, criterion, period.

use dynid_linalg::Mat;

use crate::constraint::PathConstraint;
use crate::criterion::{ColumnScaling, Criterion, Measure};
use crate::model::ExcitationModel;
use crate::parametrisation::StartConditions;
use dynid_motion::trajectory::MotionLimits;

/// A design problem.
pub struct Problem {
    /// Model whose parameters are to become visible.
    pub model: Box<dyn ExcitationModel>,
    /// Names of the coordinates.
    pub coordinates: Vec<String>,
    /// Limits that are linear in the coefficients, one entry per coordinate; positions need a finite range, which sets the
    /// scale of the search.
    pub limits: Vec<MotionLimits>,
    /// Limits that are not: efforts, distances.
    pub constraints: Vec<Box<dyn PathConstraint>>,
    /// Fundamental `ω`, rad/s.
    pub base: f64,
    /// Harmonics `L`.
    pub harmonics: usize,
    /// Conditions at the start and end of every period.
    pub start: StartConditions,
    /// What is minimised.
    pub criterion: Criterion,
    /// Factor of every output's rows, `1/σ` of its noise; ones where noise is not known.
    pub output_weights: Vec<f64>,
    /// Independent samples that the log will hold: the information of a period counts as that of so many samples, on
    /// whatever grid it is computed.
    pub effective_samples: f64,
    /// Information that is there already: a triangle of earlier rows, weighted alike, in the model's columns.
    pub prior: Option<Mat>,
    /// Width of the smoothed sign of velocities during the search, rad/s or m/s.
    pub sign_width: f64,
    /// Samples of a period during the search.
    pub samples: usize,
}

/// Width of the smoothed sign of velocities, unless chosen otherwise.
pub const DEFAULT_SIGN_WIDTH: f64 = 0.02;

/// Samples per harmonic of a period during the search, unless chosen otherwise.
pub const DEFAULT_SAMPLES_PER_HARMONIC: usize = 20;

/// More samples of a period than any search can use.
const LARGEST_SAMPLES: usize = 100_000;

/// A problem that cannot be posed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemError {
    /// A list has the wrong length.
    #[error("{what}: expected {expected} entries, found {found}")]
    Count {
        /// Name of the list.
        what: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// A number is out of range.
    #[error("{what}: expected {expected}, found {found}")]
    Value {
        /// Name of the number.
        what: String,
        /// The range it must lie in.
        expected: &'static str,
        /// The number given.
        found: f64,
    },
    /// Columns of the model cannot be told apart by any motion.
    #[error("the observation matrix is rank deficient on random motion: {} cannot be told apart", columns.join(", "))]
    RankDeficient {
        /// Columns that carry the direction without effect.
        columns: Vec<String>,
    },
}

impl Problem {
    /// Period, s.
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.base
    }

    /// Checks sizes and numbers.
    ///
    /// # Errors
    /// [`ProblemError::Count`], [`ProblemError::Value`].
    pub fn check(&self) -> Result<(), ProblemError> {
        let n = self.model.coordinates();
        let p = self.model.columns().len();
        count("coordinates", n, self.coordinates.len())?;
        count("limits", n, self.limits.len())?;
        count("output weights", self.model.outputs(), self.output_weights.len())?;
        if p == 0 {
            return Err(value("columns", "at least one", 0.0));
        }
        if let Some(pose) = &self.start.pose {
            count("start pose", n, pose.len())?;
            for (name, q) in self.coordinates.iter().zip(pose) {
                finite(&format!("start pose of {name}"), *q)?;
            }
        }
        if let Some(prior) = &self.prior {
            count("prior information", p, prior.ncols())?;
            for column in 0..p {
                prior.col(column).iter().try_for_each(|x| finite("prior information", *x))?;
            }
        }
        self.check_criterion(p)?;
        positive("base frequency", self.base)?;
        positive("width of the smoothed sign", self.sign_width)?;
        positive("effective samples", self.effective_samples)?;
        for weight in &self.output_weights {
            positive("output weight", *weight)?;
        }
        if self.harmonics == 0 || self.harmonics > 100 {
            return Err(value("harmonics", "1 to 100", self.harmonics as f64));
        }
        let conditions = usize::from(self.start.rest) + usize::from(self.start.zero_jerk);
        if self.harmonics <= conditions {
            return Err(value(
                "harmonics",
                "more than conditions on rates at the start",
                self.harmonics as f64,
            ));
        }
        if self.samples < 4 * self.harmonics || self.samples > LARGEST_SAMPLES {
            let expected = "at least 4 per harmonic, at most 100000";
            return Err(value("samples of a period", expected, self.samples as f64));
        }
        let rows = self.samples * self.model.outputs() + self.prior.as_ref().map_or(0, Mat::nrows);
        if rows < p {
            return Err(value("rows of the search's grid", "no fewer than columns", rows as f64));
        }
        for (name, limits) in self.coordinates.iter().zip(&self.limits) {
            let (low, high) = limits.position;
            if !(low.is_finite() && high.is_finite() && low < high) {
                return Err(value(
                    &format!("position range of {name}"),
                    "finite, least below largest",
                    high - low,
                ));
            }
            for (what, limit) in
                [("velocity", limits.velocity), ("acceleration", limits.acceleration), ("jerk", limits.jerk)]
            {
                if limit.is_nan() || limit <= 0.0 {
                    return Err(value(&format!("{what} limit of {name}"), "a positive number", limit));
                }
            }
        }
        Ok(())
    }

    fn check_criterion(&self, columns: usize) -> Result<(), ProblemError> {
        if let ColumnScaling::Given(scale) = &self.criterion.scaling {
            count("column scales", columns, scale.len())?;
            scale.iter().try_for_each(|s| positive("column scale", *s))?;
        }
        match &self.criterion.measure {
            Measure::Trace(weights) => {
                count("weights of the trace", columns, weights.len())?;
                weights.iter().try_for_each(|w| not_negative("weight of the trace", *w))?;
                positive("weight of the trace, sum", weights.iter().sum())
            }
            Measure::ConditionAndSmallest { condition, smallest } => {
                not_negative("weight of the condition number", *condition)?;
                not_negative("weight of the smallest singular value", *smallest)?;
                positive("weights of the criterion, sum", condition + smallest)
            }
            Measure::Largest { of, order } => {
                count("columns of the combinations", columns, of.ncols())?;
                if of.nrows() == 0 {
                    return Err(value("combinations", "at least one", 0.0));
                }
                of.col_iter().flatten().try_for_each(|x| finite("entry of a combination", *x))?;
                match *order >= 1.0 && order.is_finite() {
                    true => Ok(()),
                    false => {
                        Err(value("order of the largest deviation", "a finite number of at least 1", *order))
                    }
                }
            }
            Measure::Condition | Measure::Smallest | Measure::Determinant => Ok(()),
        }
    }
}

pub(crate) fn count(what: &'static str, expected: usize, found: usize) -> Result<(), ProblemError> {
    if expected == found { Ok(()) } else { Err(ProblemError::Count { what, expected, found }) }
}

pub(crate) fn finite(what: &str, x: f64) -> Result<(), ProblemError> {
    if x.is_finite() { Ok(()) } else { Err(value(what, "a finite number", x)) }
}

fn not_negative(what: &str, x: f64) -> Result<(), ProblemError> {
    if x >= 0.0 && x.is_finite() { Ok(()) } else { Err(value(what, "a finite number, not negative", x)) }
}

fn positive(what: &str, x: f64) -> Result<(), ProblemError> {
    if x > 0.0 && x.is_finite() { Ok(()) } else { Err(value(what, "a positive finite number", x)) }
}

pub(crate) fn value(what: &str, expected: &'static str, found: f64) -> ProblemError {
    ProblemError::Value { what: what.to_owned(), expected, found }
}
