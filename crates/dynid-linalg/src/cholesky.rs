//! Symmetric positive definite matrices.

use crate::{AsView, Mat, View};
use faer::Side;
use faer::linalg::solvers::{Llt, Solve};

/// `A = L Lᵀ` of a symmetric positive definite matrix.
#[derive(Debug, Clone)]
pub struct Cholesky(Llt<f64>);

impl Mat {
    /// `A = L Lᵀ` from the lower half of a symmetric matrix; `None` unless it is positive definite to rounding.
    pub fn cholesky(&self) -> Option<Cholesky> {
        Cholesky::new(self)
    }
}

impl Cholesky {
    pub(crate) fn new(a: &Mat) -> Option<Self> {
        a.0.llt(Side::Lower).ok().map(Cholesky)
    }

    /// `L`, lower triangular.
    pub fn lower(&self) -> View<'_> {
        View(self.0.L())
    }

    /// `A⁻¹ B`.
    pub fn solve(&self, b: &impl AsView) -> Mat {
        self.solve_view(b.view())
    }

    fn solve_view(&self, b: View<'_>) -> Mat {
        Mat(self.0.solve(b.0))
    }

    /// `A⁻¹ b`.
    pub fn solve_vector(&self, b: &[f64]) -> Vec<f64> {
        self.solve(&Mat::column(b)).col(0).to_vec()
    }
}
