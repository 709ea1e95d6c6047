//! Settings of a run, whatever the algorithm.

use super::bounds::Bounds;
use super::error::SearchError;

/// Budget, seed and what else all algorithms share.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Most iterations. Default: as the algorithm says if `evaluations` is absent too, else without limit.
    pub iterations: Option<u64>,
    /// Most evaluations of the objective, kept exactly: the last group of candidates is cut. Default: as `iterations`.
    pub evaluations: Option<u64>,
    /// Ends the run after the iteration in which the best value gets this low. Default: none.
    pub target: Option<f64>,
    /// Ends the run after so many iterations in a row without improvement. Default: none.
    pub stall: Option<u64>,
    /// Size of the population. Default: as the algorithm says.
    pub population: Option<usize>,
    /// Seed of the run; every run has one random stream. Default 1.
    pub seed: u64,
    /// Where pattern search and the first mean of CMA-ES start (default: the middle of the box, a random point); a member
    /// of the initial population of the others (default: all of them random).
    pub start: Option<Vec<f64>>,
    /// Most points of the convergence history; beyond them, every second is dropped. Default 500.
    pub history: usize,
}

impl Default for Settings {
    fn default() -> Self {
        Settings {
            iterations: None,
            evaluations: None,
            target: None,
            stall: None,
            population: None,
            seed: 1,
            start: None,
            history: 500,
        }
    }
}

impl Settings {
    pub(super) fn check(&self, bounds: &Bounds) -> Result<(), SearchError> {
        for (budget, what) in [(self.iterations, "iterations"), (self.evaluations, "evaluations")] {
            if budget == Some(0) {
                return Err(SearchError::NoBudget { what });
            }
        }
        if self.target.is_some_and(f64::is_nan) {
            return Err(SearchError::Target);
        }
        let Some(start) = &self.start else { return Ok(()) };
        if start.len() != bounds.dimensions() {
            return Err(SearchError::StartLength { expected: bounds.dimensions(), found: start.len() });
        }
        for (index, &value) in start.iter().enumerate() {
            let (lower, upper) = (bounds.lower()[index], bounds.upper()[index]);
            if !(value.is_finite() && lower <= value && value <= upper) {
                return Err(SearchError::StartOutside { index, value, lower, upper });
            }
        }
        Ok(())
    }
}
