//! Physically consistent estimates beside a running estimator.

use dynid_online::Estimator;

use crate::consistent::{ConsistentEstimate, Problem, ProblemError, Settings, estimate};
use dynid_linalg::Mat;

/// A consistent estimate and the sample it stands for.
#[derive(Debug, Clone, PartialEq)]
pub struct PublishedEstimate {
    /// Samples that the estimator had taken.
    pub samples: u64,
    /// The estimate.
    pub estimate: ConsistentEstimate,
}

/// Publishes the consistent parameters that fit a recursive state best, every so many samples.
///
/// The state stays as it is: a state that was itself projected would be biased by all projections before.
/// What is minimised is `‖R x - z‖²` over consistent `x` ([`crate::consistent`]), where `(R, z)` hold samples
/// and prior of the estimator.
///
/// The solver starts anew each time, since interior-point methods gain little from a solution nearby; a robot
/// of seven links takes some milliseconds. Call it beside the loop that feeds the estimator
/// ([`Self::publish`] with a clone), or within where there is time.
#[derive(Debug, Clone)]
pub struct ConsistentPublisher {
    problem: Problem,
    settings: Settings,
    every: u64,
    last: Option<PublishedEstimate>,
}

impl ConsistentPublisher {
    /// Publishes every `every ≥ 1` samples (0.5 s is usual). Links, scalars and bounds are those of
    /// `problem`, whose rows are not used.
    pub fn new(problem: Problem, settings: Settings, every: u64) -> Self {
        Self { problem, settings, every: every.max(1), last: None }
    }

    /// Publishes if it is time to: when the estimator has taken a multiple of `every` samples.
    ///
    /// # Errors
    /// [`ProblemError`] of the solver; what was published last stays.
    pub fn step(&mut self, estimator: &Estimator) -> Result<Option<&PublishedEstimate>, ProblemError> {
        let samples = estimator.samples();
        let due = samples > 0 && samples.is_multiple_of(self.every);
        if !due || self.last.as_ref().is_some_and(|last| last.samples == samples) {
            return Ok(None);
        }
        self.publish(estimator).map(Some)
    }

    /// Publishes now.
    ///
    /// # Errors
    /// [`ProblemError`] of the solver, also when estimator and problem differ in their number of parameters.
    pub fn publish(&mut self, estimator: &Estimator) -> Result<&PublishedEstimate, ProblemError> {
        let root = estimator.information();
        let scale = &estimator.settings().scale;
        let p = root.columns();
        self.problem.r = Mat::from_fn(p, p, |i, j| root.r(i, j) / scale[j]);
        self.problem.z = (0..p).map(|i| root.z(i)).collect();
        let estimate = estimate(&self.problem, &self.settings)?;
        Ok(self.last.insert(PublishedEstimate { samples: estimator.samples(), estimate }))
    }

    /// What was published last.
    pub fn last(&self) -> Option<&PublishedEstimate> {
        self.last.as_ref()
    }
}
