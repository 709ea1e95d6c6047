//! Triangular factor of a block of rows of `[W y]`.
//!
//! The QR factorisation of `[W y]` leaves `[[R, z], [0, ρ]]`. With the number `N` of rows consumed this is all
//! that a squared loss needs of the samples: for every `x`
//!
//! `‖y - W x‖² = ‖z - R x‖² + ρ²` and `Wᵀ(y - W x) = Rᵀ(z - R x)`.
//!
//! Source: Golub & Van Loan, *Matrix Computations*, sections 5.2 and 5.3.

mod algebra;
mod builder;

pub use builder::{DEFAULT_CHUNK_ROWS, FactorBuilder, FactorError};

use dynid_linalg::Mat;
use dynid_linalg::triangular::solve_upper;

/// Triangular factor `(R, z, ρ, N)` of `N` rows of `[W y]`.
///
/// - `R`: upper trapezoid, `height × p` with `height = min(N, p)` at most; the first non-zero entry of each row
///   is positive, so that factors of the same rows compare.
/// - `z`: `height` entries. `ρ ≥ 0`: what lies below.
///
/// When the columns are dependent, rows of `R` below the numerical rank hold rounding noise (or are shifted up,
/// as in a row-echelon form) and the least residual norm may sit partly in `z` instead of `ρ`. All methods hold
/// regardless; but do not read the rank off the diagonal, use [`crate::rank`].
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    /// `[R z]`, `height × (columns + 1)`, zeros below the diagonal.
    triangle: Mat,
    rho: f64,
    columns: usize,
    rows: usize,
}

impl Factor {
    /// Factor of no rows, with `columns` parameters.
    pub fn empty(columns: usize) -> Self {
        Self { triangle: Mat::zeros(0, columns + 1), rho: 0.0, columns, rows: 0 }
    }

    /// A factor from what was written of one: `[R z]` column-major with `height` rows.
    pub(crate) fn of_parts(columns: usize, triangle: Vec<f64>, height: usize, rho: f64, rows: usize) -> Self {
        let triangle = Mat::from_fn(height, columns + 1, |i, j| triangle[j * height + i]);
        Self { triangle, rho, columns, rows }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number `N` of rows consumed.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of stored rows of `R`, at most `min(N, p)`.
    pub fn height(&self) -> usize {
        self.triangle.nrows()
    }

    /// Entry `R[row, column]`, zero below the stored rows. Panics outside `p × p`.
    pub fn r(&self, row: usize, column: usize) -> f64 {
        assert!(row < self.columns && column < self.columns, "R is p × p");
        if row < self.height() { self.triangle[(row, column)] } else { 0.0 }
    }

    /// `R` as a `p × p` matrix, padded by zero rows.
    pub fn r_matrix(&self) -> Mat {
        Mat::from_fn(self.columns, self.columns, |i, j| self.r(i, j))
    }

    /// `z` (`p` entries, padded by zeros), in the unit of effort.
    pub fn z(&self) -> Vec<f64> {
        (0..self.columns)
            .map(|i| if i < self.height() { self.triangle[(i, self.columns)] } else { 0.0 })
            .collect()
    }

    /// `ρ ≥ 0`, in the unit of effort; the least residual norm when `R` has full rank.
    pub fn rho(&self) -> f64 {
        self.rho
    }

    /// `‖y‖ = √(‖z‖² + ρ²)`.
    pub fn effort_norm(&self) -> f64 {
        self.triangle.col_norm(self.columns).hypot(self.rho)
    }

    /// `[R z]` with its stored rows only.
    pub fn triangle(&self) -> &Mat {
        &self.triangle
    }

    /// `z - R x` over the stored rows. Panics unless `x` has `p` entries.
    fn reduced_residual(&self, x: &[f64]) -> Vec<f64> {
        assert_eq!(x.len(), self.columns, "x needs one entry per column of the factor");
        let mut residual: Vec<f64> = (0..self.height()).map(|i| self.triangle[(i, self.columns)]).collect();
        for (j, &value) in x.iter().enumerate() {
            for (i, r) in residual.iter_mut().enumerate().take(j + 1) {
                *r -= self.triangle[(i, j)] * value;
            }
        }
        residual
    }

    /// Residual sum of squares `‖y - W x‖² = ‖z - R x‖² + ρ²`. Panics unless `x` has `p` entries.
    pub fn rss(&self, x: &[f64]) -> f64 {
        self.reduced_residual(x).iter().map(|r| r * r).sum::<f64>() + self.rho * self.rho
    }

    /// Score `Wᵀ(y - W x) = Rᵀ(z - R x)`, `p` entries. Panics unless `x` has `p` entries.
    pub fn score(&self, x: &[f64]) -> Vec<f64> {
        let residual = self.reduced_residual(x);
        (0..self.columns)
            .map(|j| residual.iter().take(j + 1).enumerate().map(|(i, r)| self.triangle[(i, j)] * r).sum())
            .collect()
    }

    /// `R⁻¹ z`, the least-squares solution of a factor of full rank.
    pub fn solve(&self) -> Vec<f64> {
        let z = self.z();
        let x = solve_upper(&self.r_matrix(), &Mat::from_fn(z.len(), 1, |i, _| z[i]));
        (0..z.len()).map(|i| x[(i, 0)]).collect()
    }

    /// Column norms `‖W_c‖ = ‖R_c‖`, `p` entries.
    pub fn column_norms(&self) -> Vec<f64> {
        (0..self.columns).map(|j| self.triangle.col_norm(j)).collect()
    }
}
