//! The unknowns that obey equalities: a plane `E ξ = e`.

use dynid_linalg::{Mat, Qr};

/// `{ξ : E ξ = e}` with `Eᵀ = Q₁ U` and an orthonormal basis `N` of the directions in it.
#[derive(Debug)]
pub(super) struct Manifold {
    /// Rows of `E`, of unit length.
    rows: Mat,
    values: Vec<f64>,
    /// QR of `Eᵀ`.
    qr: Qr,
    /// `N`.
    directions: Mat,
}

impl Manifold {
    /// From independent rows `(terms, value)`; `None` without any.
    pub(super) fn new(unknowns: usize, equalities: &[(Vec<(usize, f64)>, f64)]) -> Option<Self> {
        if equalities.is_empty() {
            return None;
        }
        let mut rows = Mat::zeros(equalities.len(), unknowns);
        let mut values = Vec::with_capacity(equalities.len());
        for (i, (terms, value)) in equalities.iter().enumerate() {
            let length = terms.iter().map(|(_, f)| f * f).sum::<f64>().sqrt();
            terms.iter().for_each(|(k, f)| rows[(i, *k)] += f / length);
            values.push(value / length);
        }
        let qr = Mat::from_fn(unknowns, equalities.len(), |k, i| rows[(i, k)]).qr();
        let q = qr.q();
        let free = unknowns - equalities.len();
        let directions = Mat::from_fn(unknowns, free, |k, j| q[(k, equalities.len() + j)]);
        Some(Manifold { rows, values, qr, directions })
    }

    /// The same plane with one more unknown, which no equality knows.
    pub(super) fn with_one_more(&self) -> Self {
        let (t, n) = (self.rows.nrows(), self.rows.ncols());
        let of = |i: usize| -> Vec<(usize, f64)> { (0..n).map(|k| (k, self.rows[(i, k)])).collect() };
        let equalities: Vec<_> = (0..t).map(|i| (of(i), self.values[i])).collect();
        Manifold::new(n + 1, &equalities).unwrap_or_else(|| unreachable!("there are equalities"))
    }

    /// `E`.
    pub(super) fn rows(&self) -> &Mat {
        &self.rows
    }

    /// `N`.
    pub(super) fn directions(&self) -> &Mat {
        &self.directions
    }

    /// `E ξ - e`.
    pub(super) fn residual(&self, xi: &[f64]) -> Vec<f64> {
        self.rows.times(xi).iter().zip(&self.values).map(|(x, e)| x - e).collect()
    }

    /// The nearest point of the plane.
    pub(super) fn project(&self, xi: &[f64]) -> Vec<f64> {
        // The change with the least length that makes up for the residual: Eᵀ (E Eᵀ)⁻¹ r.
        let residual = self.residual(xi);
        let t = residual.len();
        let (q, r) = (self.qr.q(), self.qr.r());
        let mut y = residual;
        for i in 0..t {
            let known: f64 = (0..i).map(|k| r[(k, i)] * y[k]).sum();
            y[i] = (y[i] - known) / r[(i, i)];
        }
        (0..xi.len()).map(|k| xi[k] - (0..t).map(|i| q[(k, i)] * y[i]).sum::<f64>()).collect()
    }

    /// Multipliers `λ` that bring `cost + Eᵀ λ` nearest to zero.
    pub(super) fn multipliers(&self, cost: &[f64]) -> Vec<f64> {
        let side = Mat::from_fn(cost.len(), 1, |k, _| -cost[k]);
        let found = self.qr.solve_least_squares(&side);
        (0..self.rows.nrows()).map(|i| found[(i, 0)]).collect()
    }

    /// `Eᵀ λ` added to a cost; returns `λᵀ e`.
    pub(super) fn charge(&self, multipliers: &[f64], cost: &mut [f64]) -> f64 {
        for (k, c) in cost.iter_mut().enumerate() {
            *c += multipliers.iter().enumerate().map(|(i, y)| y * self.rows[(i, k)]).sum::<f64>();
        }
        multipliers.iter().zip(&self.values).map(|(y, e)| y * e).sum()
    }
}
