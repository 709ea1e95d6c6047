//! The scale on which shape parameters are searched.

use dynid_model::ShapeParameter;

/// Bounds of the searched coordinates `u`: `α` itself, or `ln α` for a logarithmic parameter.
#[derive(Debug, Clone)]
pub(super) struct SearchBox {
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
    /// The given start, brought between the bounds.
    pub(super) start: Vec<f64>,
    logarithmic: Vec<bool>,
    bounds: Vec<(f64, f64)>,
}

impl SearchBox {
    pub(super) fn new(parameters: &[ShapeParameter]) -> Self {
        let scaled = |p: &ShapeParameter, x: f64| if p.logarithmic { x.ln() } else { x };
        let mut search = SearchBox {
            lower: parameters.iter().map(|p| scaled(p, p.lower)).collect(),
            upper: parameters.iter().map(|p| scaled(p, p.upper)).collect(),
            start: parameters.iter().map(|p| scaled(p, p.start)).collect(),
            logarithmic: parameters.iter().map(|p| p.logarithmic).collect(),
            bounds: parameters.iter().map(|p| (p.lower, p.upper)).collect(),
        };
        let start = search.start.clone();
        search.start = search.clipped(&start);
        search
    }

    pub(super) fn len(&self) -> usize {
        self.lower.len()
    }

    pub(super) fn is_finite(&self, k: usize) -> bool {
        self.lower[k].is_finite() && self.upper[k].is_finite()
    }

    pub(super) fn clipped(&self, u: &[f64]) -> Vec<f64> {
        u.iter().enumerate().map(|(k, u)| u.clamp(self.lower[k], self.upper[k])).collect()
    }

    /// `u(α)` of one parameter.
    pub(super) fn searched(&self, k: usize, natural: f64) -> f64 {
        let u = if self.logarithmic[k] { natural.ln() } else { natural };
        match self.bounds[k] {
            (lower, _) if natural <= lower => self.lower[k],
            (_, upper) if natural >= upper => self.upper[k],
            _ => u,
        }
    }

    /// Whether a value lies within the bounds of a parameter.
    pub(super) fn contains(&self, k: usize, natural: f64) -> bool {
        let (lower, upper) = self.bounds[k];
        (lower..=upper).contains(&natural)
    }

    pub(super) fn at_lower(&self, k: usize, u: f64) -> bool {
        u <= self.lower[k]
    }

    pub(super) fn at_upper(&self, k: usize, u: f64) -> bool {
        u >= self.upper[k]
    }

    /// `α(u)`; a bound is met to the last bit.
    pub(super) fn natural(&self, u: &[f64]) -> Vec<f64> {
        (0..u.len())
            .map(|k| {
                let (lower, upper) = self.bounds[k];
                if self.at_lower(k, u[k]) {
                    lower
                } else if self.at_upper(k, u[k]) {
                    upper
                } else if self.logarithmic[k] {
                    u[k].exp().clamp(lower, upper)
                } else {
                    u[k]
                }
            })
            .collect()
    }

    /// `dα_k/du_k` at `α`.
    pub(super) fn slope(&self, k: usize, natural: f64) -> f64 {
        if self.logarithmic[k] { natural } else { 1.0 }
    }

    /// A point by shares of the box; parameters without finite bounds stay at the start.
    pub(super) fn share(&self, shares: &[f64]) -> Vec<f64> {
        (0..self.len())
            .map(|k| match self.is_finite(k) {
                true => self.lower[k] + shares[k] * (self.upper[k] - self.lower[k]),
                false => self.start[k],
            })
            .collect()
    }
}
