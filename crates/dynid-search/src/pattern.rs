//! Generalised pattern search with the positive basis of 2n directions.
//!
//! From the start `x` with mesh `Δ = 1`:
//!
//! ```text
//! poll x + Δ s_j e_j for all j, then x - Δ s_j e_j for all j, clipped to the bounds, up to the first improvement
//! improved: x ← that point, Δ ← min(2Δ, largest);  else Δ ← Δ/2
//! ```
//!
//! until `Δ` is below its limit (converged) or the budget is used: by default 100 n iterations (polls) and 2000 n
//! evaluations. Scales `s_j = |start_j|`; where the start is 0, a tenth of the width of the bounds, or 1 without one;
//! logarithmic coordinates: 1, a factor e. Points that clipping leaves at `x` are not evaluated again. One-sided bounds
//! and none are allowed if there is a start.
//!
//! Deterministic: the seed has no effect. Sources: Torczon 1997; Rosyid & El-Khasawneh 2020 (scales, factors and limits).

use super::error::SearchError;
use super::range::positive;
use super::run::{Method, Run, Step};
use dynid_words::Transfer;

/// Parameters of pattern search.
#[derive(Debug, Clone, PartialEq)]
pub struct PatternSearch {
    /// First mesh `Δ`, positive. Default 1.
    pub mesh: f64,
    /// Mesh below which the search has converged, positive. Default 1e-6.
    pub smallest_mesh: f64,
    /// Mesh that successes do not exceed, at least the first one. Default infinite. With the first mesh as limit a search
    /// wastes fewer polls on meshes far too wide.
    pub largest_mesh: f64,
}

impl Default for PatternSearch {
    fn default() -> Self {
        PatternSearch { mesh: 1.0, smallest_mesh: 1e-6, largest_mesh: f64::INFINITY }
    }
}

impl PatternSearch {
    pub(super) fn check(&self, algorithm: &'static str) -> Result<(), SearchError> {
        positive(algorithm, "mesh", self.mesh)?;
        positive(algorithm, "smallest_mesh", self.smallest_mesh)?;
        if self.largest_mesh < self.mesh || self.largest_mesh.is_nan() {
            let (parameter, expected) = ("largest_mesh", "the first mesh or more");
            return Err(SearchError::Parameter { algorithm, parameter, expected, found: self.largest_mesh });
        }
        Ok(())
    }
}

#[derive(Clone)]
pub(super) struct Pattern {
    smallest_mesh: f64,
    largest_mesh: f64,
    mesh: f64,
    scales: Vec<f64>,
    point: Vec<f64>,
    value: f64,
}

impl Pattern {
    pub(super) fn new(parameters: &PatternSearch, dimensions: usize) -> Pattern {
        Pattern {
            smallest_mesh: parameters.smallest_mesh,
            largest_mesh: parameters.largest_mesh,
            mesh: parameters.mesh,
            scales: vec![1.0; dimensions],
            point: vec![0.0; dimensions],
            value: f64::INFINITY,
        }
    }

    /// The first improvement around the present point.
    fn poll(&self, run: &mut Run<'_>) -> Option<(Vec<f64>, f64)> {
        let directions =
            [1.0, -1.0].into_iter().flat_map(|sign| (0..self.point.len()).map(move |j| (sign, j)));
        let mut candidate = self.point.clone();
        for (sign, j) in directions {
            candidate[j] = run.bounds.clip(j, self.point[j] + sign * self.mesh * self.scales[j]);
            if candidate[j] != self.point[j] && candidate[j].is_finite() {
                let value = run.evaluate_one(&candidate);
                if value < self.value {
                    return Some((candidate, value));
                }
                candidate[j] = self.point[j];
            }
        }
        None
    }
}

impl Method for Pattern {
    fn start(&mut self, run: &mut Run<'_>) {
        for j in 0..self.point.len() {
            let (lower, upper) = run.bounds.search(j);
            self.point[j] = run.start().map_or(0.5 * (lower + upper), |start| start[j]);
            let size = self.point[j].abs();
            let width = run.bounds.width(j);
            self.scales[j] = match () {
                () if run.bounds.is_logarithmic(j) => 1.0,
                () if size > 0.0 => size,
                () if width.is_finite() && width > 0.0 => 0.1 * width,
                () => 1.0,
            };
        }
        self.value = run.evaluate_one(&self.point);
    }

    fn iterate(&mut self, run: &mut Run<'_>) -> Step {
        match self.poll(run) {
            Some((point, value)) => {
                (self.point, self.value) = (point, value);
                self.mesh = (2.0 * self.mesh).min(self.largest_mesh);
            }
            None => self.mesh *= 0.5,
        }
        if self.mesh < self.smallest_mesh { Step::Converged } else { Step::GoOn }
    }

    fn fields(&mut self, transfer: &mut Transfer<'_>) {
        transfer.real(&mut self.mesh);
        transfer.reals(&mut self.scales);
        transfer.reals(&mut self.point);
        transfer.real(&mut self.value);
    }
}
