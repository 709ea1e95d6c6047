//! Ordinary least squares, `min ‖z - R x‖²`.

use dynid_factor::factor::Factor;
use dynid_factor::rank::{RankReport, certainly_full_rank, numerical_rank};
use dynid_linalg::Mat;
use dynid_linalg::triangular::gram_inverse;

/// Least-squares solution of one factor, on an independent subset of the columns where the rank is deficient.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearSolution {
    /// `p` parameters; those of dropped columns are zero.
    pub x: Vec<f64>,
    /// Independent columns the solution uses, ascending. All columns at full rank.
    pub kept: Vec<usize>,
    /// Unexcited and dependent columns left out, ascending.
    pub dropped: Vec<usize>,
    /// Least residual sum of squares (weighted if the factor was), effort².
    pub rss: f64,
    /// Number `N` of rows.
    pub rows: usize,
    /// Condition number of the kept columns in their own units.
    pub condition: f64,
    /// Condition number of the kept columns scaled to unit norm.
    pub condition_scaled: f64,
    /// Rank of all columns, with the evidence.
    pub rank: RankReport,
    /// Factor of the kept columns.
    pub factor: Factor,
}

impl LinearSolution {
    /// `C = (RᵀR)⁻¹` of the kept columns (`kept × kept`): the covariance for unit residual variance.
    pub fn unit_covariance(&self) -> Mat {
        gram_inverse(&self.factor.r_matrix())
    }

    /// Residual variance `rss/(N - rank)`, effort²; `None` without a degree of freedom.
    pub fn residual_variance(&self) -> Option<f64> {
        (self.rows > self.kept.len()).then(|| self.rss / (self.rows - self.kept.len()) as f64)
    }

    /// Standard deviations `√(variance · C_ii)` per parameter, `None` where the column was dropped.
    ///
    /// `variance`: 1 for a factor weighted by `1/σ`, [`Self::residual_variance`] for an unweighted one.
    pub fn standard_deviations(&self, variance: f64) -> Vec<Option<f64>> {
        let covariance = self.unit_covariance();
        self.expand((0..self.kept.len()).map(|i| (variance * covariance[(i, i)]).sqrt()))
    }

    fn expand(&self, values: impl Iterator<Item = f64>) -> Vec<Option<f64>> {
        let mut full = vec![None; self.x.len()];
        for (&column, value) in self.kept.iter().zip(values) {
            full[column] = Some(value);
        }
        full
    }
}

/// Least squares on the merged rows of one factor.
///
/// Columns are scaled to unit norm for the rank decision only; substitution is unaffected by column scaling.
/// A rank-deficient factor is solved on the independent columns of column-pivoted QR, the others being set to
/// zero and listed in [`LinearSolution::dropped`].
pub fn ols(factor: &Factor) -> LinearSolution {
    let rank = numerical_rank(factor);
    let kept = rank.independent.clone();
    let dropped: Vec<usize> = (0..rank.columns).filter(|c| kept.binary_search(c).is_err()).collect();
    let (reduced, condition, condition_scaled) = if dropped.is_empty() {
        (factor.clone(), rank.condition, rank.condition_scaled)
    } else {
        let reduced = factor.select(&kept);
        let of_kept = numerical_rank(&reduced);
        (reduced, of_kept.condition, of_kept.condition_scaled)
    };
    let mut x = vec![0.0; rank.columns];
    for (&column, value) in kept.iter().zip(reduced.solve()) {
        x[column] = value;
    }
    let rss = reduced.rho() * reduced.rho();
    LinearSolution {
        x,
        kept,
        dropped,
        rss,
        rows: factor.rows(),
        condition,
        condition_scaled,
        rank,
        factor: reduced,
    }
}

/// Parameters of a factor, and the columns behind them, without the evidence of its rank.
pub(crate) struct Solved {
    /// `p` parameters; those of dropped columns are zero.
    pub(crate) x: Vec<f64>,
    /// Independent columns the solution uses, ascending.
    pub(crate) kept: Vec<usize>,
    /// Factor of the kept columns.
    pub(crate) factor: Factor,
}

/// What [`ols`] solves for, the same bits: singular values take most of its time, and only factors need them that may be rank-deficient.
pub(crate) fn solved(factor: Factor) -> Solved {
    if certainly_full_rank(&factor) {
        return Solved { x: factor.solve(), kept: (0..factor.columns()).collect(), factor };
    }
    let LinearSolution { x, kept, factor, .. } = ols(&factor);
    Solved { x, kept, factor }
}

/// [`LinearSolution::x`] (`p` parameters, those of dropped columns zero) and [`LinearSolution::rss`] (effort²) of [`ols`], the same bits
/// without the evidence of its rank.
///
/// Singular values take most of the time of [`ols`]; here only factors need them that may be rank-deficient.
pub fn ols_values(factor: &Factor) -> (Vec<f64>, f64) {
    if certainly_full_rank(factor) {
        return (factor.solve(), factor.rho() * factor.rho());
    }
    let LinearSolution { x, rss, .. } = ols(factor);
    (x, rss)
}
