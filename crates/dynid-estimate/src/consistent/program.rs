//! The convex program in whitened unknowns.

use dynid_linalg::{Mat, PivotedQr};
use dynid_model::symmetric::{cholesky, lower_inverse, product, transpose};

use super::cone::{Lmi, Ray};
use super::manifold::Manifold;

/// `min F(ξ) = ‖A ξ - b‖² + Σ w (ξ - ξ0)² + γ Σ_i D(X_i | 1)` over matrix inequalities and half-lines, in a plane.
#[derive(Debug)]
pub(super) struct Program<const N: usize> {
    pub a: Mat,
    pub b: Vec<f64>,
    /// Rows of `A` that are data; those below are a Gaussian prior's.
    pub data_rows: usize,
    /// `w`, one per unknown.
    pub weight: Vec<f64>,
    /// `ξ0`.
    pub centre: Vec<f64>,
    /// `γ`.
    pub entropy: f64,
    pub cones: Vec<Lmi<N>>,
    /// Lower limits of scalars in the order of `lower`, then the bounds.
    pub rays: Vec<Ray>,
    /// Scalars with a lower limit.
    pub lower: Vec<(usize, f64)>,
    /// Unknowns that belong to no link.
    pub scalars: Vec<usize>,
    /// Where the equalities hold, if there are some.
    pub plane: Option<Manifold>,
}

impl<const N: usize> Program<N> {
    pub(super) fn unknowns(&self) -> usize {
        self.a.ncols()
    }

    /// Number of bounds.
    pub(super) fn bounds(&self) -> usize {
        self.rays.len() - self.lower.len()
    }

    /// Sum of the sizes of all cones.
    pub(super) fn order(&self) -> usize {
        N * self.cones.len() + self.rays.len()
    }

    /// `A ξ - b`.
    fn residual(&self, xi: &[f64]) -> Vec<f64> {
        let mut out: Vec<f64> = self.b.iter().map(|b| -b).collect();
        for (k, x) in xi.iter().enumerate() {
            for (o, a) in out.iter_mut().zip(self.a.col(k).iter()) {
                *o += a * x;
            }
        }
        out
    }

    /// `‖A ξ - b‖²` of the data.
    pub(super) fn fit(&self, xi: &[f64]) -> f64 {
        self.residual(xi)[..self.data_rows].iter().map(|r| r * r).sum()
    }

    /// `F`; `None` where the entropic distance is infinite.
    pub(super) fn objective(&self, xi: &[f64]) -> Option<f64> {
        let pull: f64 =
            xi.iter().zip(&self.centre).zip(&self.weight).map(|((x, c), w)| w * (x - c) * (x - c)).sum();
        let rows: f64 = self.residual(xi).iter().map(|r| r * r).sum();
        let mut value = rows + pull;
        if self.entropy > 0.0 {
            for cone in &self.cones {
                let x = cone.matrix(xi);
                let l = cholesky(&x)?;
                let log_det: f64 = (0..N).map(|i| 2.0 * l[i][i].ln()).sum();
                value += self.entropy * (dynid_model::symmetric::trace(&x) - log_det - N as f64);
            }
        }
        Some(value)
    }

    /// `∇F`; `None` where the entropic distance is infinite.
    pub(super) fn gradient(&self, xi: &[f64]) -> Option<Vec<f64>> {
        let residual = self.residual(xi);
        let mut gradient: Vec<f64> = (0..self.unknowns())
            .map(|k| {
                let along: f64 = self.a.col(k).iter().zip(&residual).map(|(a, r)| a * r).sum();
                2.0 * (along + self.weight[k] * (xi[k] - self.centre[k]))
            })
            .collect();
        if self.entropy > 0.0 {
            for cone in &self.cones {
                let inverse = lower_inverse(&cholesky(&cone.matrix(xi))?);
                let mut slope = product(&transpose(&inverse), &inverse);
                for (i, row) in slope.iter_mut().enumerate() {
                    row.iter_mut().for_each(|x| *x = -*x);
                    row[i] += 1.0;
                }
                for (g, s) in gradient[cone.first..].iter_mut().zip(cone.adjoint(&slope)) {
                    *g += self.entropy * s;
                }
            }
        }
        Some(gradient)
    }

    /// `2 AᵀA + 2 diag w`.
    pub(super) fn quadratic(&self) -> Mat {
        let mut h = self.a.transpose() * &self.a;
        h *= 2.0;
        for (k, w) in self.weight.iter().enumerate() {
            h[(k, k)] += 2.0 * w;
        }
        h
    }

    /// A matrix that acts on directions in the plane: `M N`, or `M` without equalities.
    pub(super) fn in_plane(&self, matrix: Mat) -> Mat {
        match &self.plane {
            None => matrix,
            Some(plane) => &matrix * plane.directions(),
        }
    }

    /// The whole change of a change in the plane.
    pub(super) fn out_of_plane(&self, change: Mat) -> Mat {
        match &self.plane {
            None => change,
            Some(plane) => plane.directions() * &change,
        }
    }

    /// The point of the plane that is nearest to `ξ0`.
    fn origin(&self) -> Vec<f64> {
        self.plane.as_ref().map_or_else(|| self.centre.clone(), |plane| plane.project(&self.centre))
    }

    /// Minimum of the quadratic part without inequalities, by QR of `[A; √w 1]`.
    pub(super) fn unconstrained(&self) -> Vec<f64> {
        let (rows, n) = (self.a.nrows(), self.unknowns());
        // Counted from ξ0, so that unseen directions are exactly the prior's.
        let origin = self.origin();
        let residual = self.residual(&origin);
        let stack = Mat::from_fn(rows + n, n, |i, j| match i.checked_sub(rows) {
            None => self.a[(i, j)],
            Some(k) if k == j => self.weight[k].sqrt(),
            Some(_) => 0.0,
        });
        let pull = |k: usize| self.weight[k].sqrt() * (self.centre[k] - origin[k]);
        let rhs = Mat::from_fn(rows + n, 1, |i, _| match i.checked_sub(rows) {
            None => -residual[i],
            Some(k) => pull(k),
        });
        let change = self.out_of_plane(self.in_plane(stack).qr().solve_least_squares(&rhs));
        origin.iter().enumerate().map(|(k, c)| c + change[(k, 0)]).collect()
    }

    /// `min ‖A ξ - b‖²` of the data over all `ξ` of the plane, by column-pivoted QR.
    pub(super) fn least_fit(&self) -> f64 {
        let (data, b) = match &self.plane {
            None => (self.a.rows(0..self.data_rows).to_mat(), self.b[..self.data_rows].to_vec()),
            Some(_) => {
                let left = self.residual(&self.origin());
                let left = left[..self.data_rows].iter().map(|r| -r).collect();
                (self.in_plane(self.a.rows(0..self.data_rows).to_mat()), left)
            }
        };
        let qr = PivotedQr::new(&data);
        let r = qr.r();
        let size = r.nrows().min(r.ncols());
        let threshold = self.data_rows.max(self.unknowns()) as f64 * f64::EPSILON * r.norm_max();
        let rank = (0..size).take_while(|k| r[(*k, *k)].abs() > threshold).count();
        let b = Mat::column(&b);
        let q = qr.thin_q();
        let seen = q.columns(0..rank);
        let left = &b - seen * (seen.transpose() * &b);
        left.col_squares(0)
    }

    /// Whether every constraint holds with room to spare.
    pub(super) fn strictly_feasible(&self, xi: &[f64]) -> bool {
        self.cones.iter().all(|c| cholesky(&c.slack(xi)).is_some())
            && self.rays.iter().all(|r| r.slack(xi) > 0.0)
    }
}
