//! What is minimised.

use rayon::prelude::*;

/// A function of `d` numbers that a search minimises.
///
/// Candidates come in groups, since many objectives (a regressor times parameters) cost less per candidate in a group.
pub trait Objective: Sync {
    /// Number of coordinates `d`.
    fn dimensions(&self) -> usize;

    /// Values of `values.len() = n` candidates, `candidates[k * d + i]` being coordinate `i` of candidate `k`.
    ///
    /// A value that is not finite says that the candidate has none; searches treat it as `+∞` and count it. A value must
    /// not depend on the other candidates of the group.
    fn evaluate(&self, candidates: &[f64], values: &mut [f64]);
}

/// A function of one point as an [`Objective`].
#[derive(Debug, Clone, Copy)]
pub struct PointObjective<F> {
    dimensions: usize,
    function: F,
    parallel: bool,
}

impl<F: Fn(&[f64]) -> f64 + Sync> PointObjective<F> {
    /// The function `function` of `dimensions` coordinates.
    pub fn new(dimensions: usize, function: F) -> Self {
        PointObjective { dimensions, function, parallel: false }
    }

    /// Candidates of a group are evaluated in parallel: worth it from some 10 µs per candidate on. Same results.
    #[must_use]
    pub fn in_parallel(self) -> Self {
        PointObjective { parallel: true, ..self }
    }
}

impl<F: Fn(&[f64]) -> f64 + Sync> Objective for PointObjective<F> {
    fn dimensions(&self) -> usize {
        self.dimensions
    }

    fn evaluate(&self, candidates: &[f64], values: &mut [f64]) {
        let points = candidates.chunks_exact(self.dimensions);
        if self.parallel {
            let points = candidates.par_chunks_exact(self.dimensions);
            values.par_iter_mut().zip(points).for_each(|(value, x)| *value = (self.function)(x));
        } else {
            values.iter_mut().zip(points).for_each(|(value, x)| *value = (self.function)(x));
        }
    }
}
