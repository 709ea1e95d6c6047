//! Numerical rank of a factor: which columns are excited, and which follow from others.
//!
//! All decisions are taken on `R S⁻¹`, `S` the column norms, so that units do not matter.
//! Rank deficiency is a finding with numbers, never an error.

mod regrouping;
mod reliability;

pub use regrouping::{BaseColumns, base_columns};
pub use reliability::column_reliability;

use crate::factor::Factor;
use dynid_linalg::{Mat, pivots};

/// Numerical rank of a factor and the evidence for it.
#[derive(Debug, Clone, PartialEq)]
pub struct RankReport {
    /// Number of singular values of `R S⁻¹` above [`Self::tolerance`].
    pub rank: usize,
    /// Number `p` of columns.
    pub columns: usize,
    /// Column norms `s_c` in the unit of the regressor column; zero for unexcited columns.
    pub column_norms: Vec<f64>,
    /// Singular values of `R S⁻¹`, descending (unexcited columns keep `s_c = 1`, hence give zeros).
    pub singular_values: Vec<f64>,
    /// `τ = 100 ε max(N, p) σ_1`.
    pub tolerance: f64,
    /// Gap `σ_r / σ_{r+1}`; `None` at full rank or rank 0, infinite when `σ_{r+1} = 0`.
    /// A gap below 1e4 leaves the rank in doubt.
    pub gap: Option<f64>,
    /// `σ_1/σ_p` of `R` in its own units; infinite when singular.
    pub condition: f64,
    /// `σ_1/σ_p` of `R S⁻¹`; infinite when singular.
    pub condition_scaled: f64,
    /// Columns in the order of column-pivoted QR (largest remaining norm first).
    pub pivot_order: Vec<usize>,
    /// The first `rank` columns of the pivot order, ascending: an independent set.
    pub independent: Vec<usize>,
    /// Excited columns outside [`Self::independent`], ascending: combinations of those.
    pub dependent: Vec<usize>,
    /// Columns that are zero in every row, ascending: not seen at all.
    pub unexcited: Vec<usize>,
}

impl RankReport {
    /// Whether every column is excited and independent.
    pub fn is_full(&self) -> bool {
        self.rank == self.columns
    }
}

/// Rank of a factor by the singular values of its scaled triangle.
///
/// Source: Golub & Van Loan, *Matrix Computations*, 5.4 and 5.5.
pub fn numerical_rank(factor: &Factor) -> RankReport {
    let columns = factor.columns();
    let column_norms = factor.column_norms();
    let scaled = scaled_triangle(factor, &column_norms);
    let singular_values = singular_values(&scaled);
    let tolerance = rank_tolerance(factor.rows(), columns, singular_values.first().copied().unwrap_or(0.0));
    let rank = singular_values.iter().take_while(|&&s| s > tolerance).count();
    let gap = (rank > 0 && rank < columns).then(|| ratio(singular_values[rank - 1], singular_values[rank]));
    let pivot_order = pivots(scaled).0;
    let mut independent = pivot_order[..rank].to_vec();
    independent.sort_unstable();
    let (unexcited, dependent): (Vec<usize>, Vec<usize>) =
        (0..columns).filter(|c| independent.binary_search(c).is_err()).partition(|&c| column_norms[c] == 0.0);
    RankReport {
        rank,
        columns,
        condition: spread(&self::singular_values(&factor.r_matrix())),
        condition_scaled: spread(&singular_values),
        column_norms,
        singular_values,
        tolerance,
        gap,
        pivot_order,
        independent,
        dependent,
        unexcited,
    }
}

/// Whether [`numerical_rank`] must find full rank, told by an inverse instead of singular values: `1/‖A⁻¹‖_F` bounds the
/// least singular value of the scaled triangle `A` from below, `√p` the largest from above.
pub fn certainly_full_rank(factor: &Factor) -> bool {
    let norms = factor.column_norms();
    if factor.height() < factor.columns() || norms.contains(&0.0) {
        return false;
    }
    let inverse = dynid_linalg::triangular::inverse(&scaled_triangle(factor, &norms));
    let largest = (factor.columns() as f64).sqrt();
    1.0 / inverse.norm_l2() > rank_tolerance(factor.rows(), factor.columns(), largest)
}

/// `τ = 100 ε max(rows, columns) σ_1`.
pub fn rank_tolerance(rows: usize, columns: usize, largest: f64) -> f64 {
    100.0 * f64::EPSILON * rows.max(columns) as f64 * largest
}

/// `R S⁻¹`, `s_c = 1` where the column is zero.
pub(crate) fn scaled_triangle(factor: &Factor, column_norms: &[f64]) -> Mat {
    Mat::from_fn(factor.columns(), factor.columns(), |i, j| {
        if column_norms[j] == 0.0 { 0.0 } else { factor.r(i, j) / column_norms[j] }
    })
}

/// Singular values of a square matrix, descending.
pub fn singular_values(matrix: &Mat) -> Vec<f64> {
    // The iteration of a finite matrix does not fail in practice; the pivoted diagonal brackets the values.
    matrix.singular_values().unwrap_or_else(|| pivots(matrix.clone()).1)
}

fn spread(singular_values: &[f64]) -> f64 {
    match (singular_values.first(), singular_values.last()) {
        (Some(&largest), Some(&least)) => ratio(largest, least),
        _ => 1.0,
    }
}

fn ratio(above: f64, below: f64) -> f64 {
    if below == 0.0 { f64::INFINITY } else { above / below }
}
