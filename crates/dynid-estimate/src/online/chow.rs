//! Whether two stretches of samples have the same parameters.

use crate::distribution::{f_exceedance, t_exceedance};
use crate::least_squares::ols;
use dynid_factor::Factor;
use dynid_factor::rank::numerical_rank;

/// A parameter and its change between two stretches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MovedParameter {
    /// Column.
    pub parameter: usize,
    /// Estimate of the second stretch less that of the first, in the parameter's unit.
    pub change: f64,
    /// `change²/(C_1 + C_2)_jj`, the square of a t-value.
    pub statistic: f64,
    /// Probability of as large a change by chance, two-sided.
    pub p_value: f64,
    /// The probability of as large a change by chance, adjusted for looking at all parameters (Holm 1979): below a level for no parameter in all
    /// but that share of cases without change.
    pub adjusted: f64,
}

/// Outcome of [`chow_test`].
#[derive(Debug, Clone, PartialEq)]
pub struct ChowTest {
    /// `F = [(ρ² - ρ_1² - ρ_2²)/p] / [(ρ_1² + ρ_2²)/(N - 2 p)]`, divided by the inflation.
    pub f: f64,
    /// Probability of as large an `F` by chance.
    pub p_value: f64,
    /// All parameters, the likeliest to have moved first.
    pub parameters: Vec<MovedParameter>,
}

impl ChowTest {
    /// Parameters that moved at the given level, the likeliest first.
    pub fn moved(&self, level: f64) -> impl Iterator<Item = &MovedParameter> {
        self.parameters.iter().filter(move |p| p.adjusted <= level)
    }
}

/// Tests whether two stretches of samples, each reduced to a factor, share their parameters.
///
/// `inflation ≥ 1`: by how much variances of plain least squares fall short because residuals are coloured
/// ([`crate::covariance::variance_inflation`]); 1 if they are white. `None` unless both factors have full
/// rank, the same columns, and together more than `2 p` rows and a residual.
///
/// Sources: Chow 1960; Holm 1979.
pub fn chow_test(first: &Factor, second: &Factor, inflation: f64) -> Option<ChowTest> {
    let p = first.columns();
    let freedom = (first.rows() + second.rows()).checked_sub(2 * p).filter(|n| *n > 0)? as f64;
    if p == 0 || second.columns() != p || inflation.is_nan() || inflation < 1.0 {
        return None;
    }
    if !numerical_rank(first).is_full() || !numerical_rank(second).is_full() {
        return None;
    }
    let (before, after) = (ols(first), ols(second));
    let own = before.rss + after.rss;
    let variance = inflation * own / freedom;
    if variance <= 0.0 {
        return None;
    }
    let merged = Factor::merge(&[first, second]);
    let f = (merged.rss(&ols(&merged).x) - own).max(0.0) / p as f64 / variance;
    let p_value = f_exceedance(f, p as f64, freedom)?;
    let (c1, c2) = (before.unit_covariance(), after.unit_covariance());
    let mut parameters: Vec<MovedParameter> = (0..p)
        .map(|j| {
            let change = after.x[j] - before.x[j];
            let statistic = change * change / (variance * (c1[(j, j)] + c2[(j, j)]));
            let p_value = 2.0 * t_exceedance(statistic.sqrt(), freedom)?;
            Some(MovedParameter { parameter: j, change, statistic, p_value, adjusted: p_value })
        })
        .collect::<Option<_>>()?;
    parameters.sort_by(|a, b| b.statistic.total_cmp(&a.statistic));
    let mut least = 0.0_f64;
    for (k, parameter) in parameters.iter_mut().enumerate() {
        least = least.max(((p - k) as f64 * parameter.p_value).min(1.0));
        parameter.adjusted = least;
    }
    Some(ChowTest { f, p_value, parameters })
}
