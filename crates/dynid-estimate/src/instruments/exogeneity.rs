//! The test of Durbin, Wu and Hausman: may least squares be believed beside instruments?

use crate::covariance::jackknife as least_squares_jackknife;
use crate::distribution::f_exceedance;
use crate::least_squares::{ols, ols_values};
use crate::oblique::{Oblique, jackknife, pair};
use dynid_factor::Factor;
use dynid_factor::groups::{ReducedGroup, time_blocks};
use dynid_factor::rank::numerical_rank;
use dynid_linalg::Mat;
use dynid_linalg::triangular::gram_inverse;

/// Settings of [`exogeneity()`].
#[derive(Debug, Clone, PartialEq)]
pub struct ExogeneitySettings {
    /// A column of `V` counts only if its length is above this share of the regressor's. Default 1e-6.
    pub column: f64,
    /// Regressors equal instruments, and there is no test, if all columns of `V` are below this share. Default 1e-3.
    pub equal: f64,
    /// Share of the prior size below which a difference is of no importance. Default 0.01.
    pub harmless: f64,
    /// Strength below which instruments are called weak. Default 0.1.
    pub weak: f64,
}

impl Default for ExogeneitySettings {
    fn default() -> Self {
        ExogeneitySettings { column: 1e-6, equal: 1e-3, harmless: 0.01, weak: 0.1 }
    }
}

/// An F test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FTest {
    /// Statistic.
    pub statistic: f64,
    /// Degrees of freedom of numerator and denominator.
    pub freedom: (f64, f64),
    /// Probability of a larger value if least squares is unbiased.
    pub p_value: f64,
}

/// What the comparison says about one base parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effect {
    /// Base column.
    pub column: usize,
    /// Least squares.
    pub least_squares: f64,
    /// Instruments.
    pub instruments: f64,
    /// Standard deviations of both: jackknife over time blocks, of independent residuals with fewer than two blocks.
    pub std: (f64, f64),
    /// `max(2 √V_ii, 1 % of the prior size)` with the larger variance of the two.
    pub limit: f64,
}

impl Effect {
    /// `θ_LS - θ_IV`.
    pub fn difference(&self) -> f64 {
        self.least_squares - self.instruments
    }

    /// `|θ_LS - θ_IV|` in parts of the limit; above 1 the bias of least squares is material.
    pub fn ratio(&self) -> f64 {
        if self.difference() == 0.0 { 0.0 } else { self.difference().abs() / self.limit }
    }
}

/// What the comparison comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExogeneityVerdict {
    /// Regressors equal instruments within a thousandth: nothing to test, nothing biased.
    Exogenous,
    /// No parameter differs by more than its limit.
    Harmless,
    /// Some parameter does.
    Material,
    /// Instruments are too weak, or see too few columns, to tell.
    Weak,
}

/// Least squares against instruments.
#[derive(Debug, Clone, PartialEq)]
pub struct Exogeneity {
    /// The verdict, by size alone.
    pub verdict: ExogeneityVerdict,
    /// One entry per base column that regressors and instruments determine.
    pub effects: Vec<Effect>,
    /// Per such column, length of what instruments leave of the regressor, `‖V_i‖/‖W_i‖`.
    pub unexplained: Vec<f64>,
    /// Base columns whose `V` is tested.
    pub tested: Vec<usize>,
    /// Smallest singular value of `Q_ZᵀQ_W`.
    pub least_cosine: f64,
    /// Time blocks.
    pub blocks: usize,
    /// F test on the coefficients of `V`, as if residuals were independent; they are not after a filter, and it rejects too often.
    pub naive: Option<FTest>,
    /// Wald test of them by the delete-a-block jackknife, times `(B - m)/(m (B - 1))` against `F(m, B - m)`: the one to believe.
    /// `None` without anything to test or with no more blocks than tested columns.
    pub robust: Option<FTest>,
}

impl Exogeneity {
    /// The parameter with the largest difference in parts of its limit.
    pub fn worst(&self) -> Option<&Effect> {
        self.effects.iter().max_by(|a, b| a.ratio().total_cmp(&b.ratio()))
    }
}

/// Compares least squares with instrumental variables on the same weighted rows.
///
/// `paired`: factors of `[Z | W | y]` for `total` base columns, with instruments from parameters that were *not* estimated on the same
/// samples ([`super::crossed`]): otherwise a true null is rejected in a third of all cases instead of one in twenty. `weights`: `1/σ_j`
/// per group, those of the least-squares fit. `sizes`: prior size of every base parameter.
///
/// With `V = W - Z Z⁺W`, what instruments do not explain, the coefficients `δ` of `y = W θ + V δ + e` vanish where `W` is free of
/// noise that is also in `y`. Rejection is common and often harmless, and an error of the model rejects as well; so the verdict is the
/// size of `θ_LS - θ_IV` against [`Effect::limit`], and the p-value stands beside it.
///
/// `None` if no column is left to compare.
///
/// # Panics
/// Unless there is one weight per group and one size per base column.
///
/// Source: Durbin 1954, Wu 1973, Hausman 1978; Janot, Vandanjon & Gautier 2016.
pub fn exogeneity(
    paired: &[ReducedGroup],
    weights: &[f64],
    total: usize,
    sizes: &[f64],
    settings: &ExogeneitySettings,
) -> Option<Exogeneity> {
    assert_eq!(sizes.len(), total, "one size per base column");
    let blocks = time_blocks(paired, weights, 2 * total);
    if blocks.is_empty() {
        return None;
    }
    let merged = Factor::merge(&blocks.iter().collect::<Vec<_>>());
    let oblique = Oblique::new(&merged);
    let p = oblique.kept.len();
    if p == 0 {
        return None;
    }
    let of_kept = pair(&oblique.kept, total);
    let blocks: Vec<Factor> = blocks.iter().map(|b| b.select(&of_kept)).collect();
    let merged = merged.select(&of_kept);
    let with_v = with_unexplained(&blocks, &oblique.fit);
    let whole = Factor::merge(&with_v.iter().collect::<Vec<_>>());
    let norms = whole.column_norms();
    let unexplained: Vec<f64> = (0..p).map(|c| norms[p + c] / norms[c]).collect();
    let tested = tested_columns(&whole, &unexplained, settings);
    let equal = unexplained.iter().all(|v| *v < settings.equal);
    let (naive, robust) = match equal || tested.is_empty() {
        true => (None, None),
        false => (naive_test(&whole, &tested), robust_test(&with_v, &tested)),
    };
    let effects = effects(&blocks, &merged, &oblique, sizes, settings);
    let verdict = if equal {
        ExogeneityVerdict::Exogenous
    } else if oblique.strength < settings.weak || p < oblique.excited {
        ExogeneityVerdict::Weak
    } else if effects.iter().any(|e| e.ratio() > 1.0) {
        ExogeneityVerdict::Material
    } else {
        ExogeneityVerdict::Harmless
    };
    Some(Exogeneity {
        verdict,
        effects,
        unexplained,
        tested: tested.iter().map(|c| oblique.kept[*c]).collect(),
        least_cosine: oblique.strength,
        blocks: blocks.len(),
        naive,
        robust,
    })
}

/// Blocks of `[W | V | y]` from paired ones.
fn with_unexplained(blocks: &[Factor], fit: &Mat) -> Vec<Factor> {
    let p = fit.nrows();
    let one = |on: bool| f64::from(u8::from(on));
    let combination = Mat::from_fn(2 * p, 2 * p, |i, j| match (i < p, j < p) {
        (true, true) => 0.0,
        (true, false) => -fit[(i, j - p)],
        (false, true) => one(i - p == j),
        (false, false) => one(i == j),
    });
    blocks.iter().map(|b| b.combined(&combination, &vec![0.0; 2 * p])).collect()
}

/// Columns of `V` that are there at all and independent of `W` and of each other.
fn tested_columns(whole: &Factor, unexplained: &[f64], settings: &ExogeneitySettings) -> Vec<usize> {
    let p = unexplained.len();
    let there: Vec<usize> = (0..p).filter(|c| unexplained[*c] > settings.column).collect();
    let columns: Vec<usize> = (0..p).chain(there.iter().map(|c| p + c)).collect();
    let independent = numerical_rank(&whole.select(&columns)).independent;
    there.iter().enumerate().filter(|(k, _)| independent.contains(&(p + k))).map(|(_, c)| *c).collect()
}

/// Columns of `W` and of the tested part of `V`.
fn augmented(p: usize, tested: &[usize]) -> Vec<usize> {
    (0..p).chain(tested.iter().map(|c| p + c)).collect()
}

fn naive_test(whole: &Factor, tested: &[usize]) -> Option<FTest> {
    let p = whole.columns() / 2;
    let m = tested.len() as f64;
    let freedom = whole.rows() as f64 - p as f64 - m;
    if freedom < 1.0 {
        return None;
    }
    let of_w: Vec<usize> = (0..p).collect();
    let (_, with) = ols_values(&whole.select(&augmented(p, tested)));
    let (_, without) = ols_values(&whole.select(&of_w));
    let statistic = ((without - with).max(0.0) / m) / (with / freedom);
    Some(FTest { statistic, freedom: (m, freedom), p_value: f_exceedance(statistic, m, freedom)? })
}

fn robust_test(with_v: &[Factor], tested: &[usize]) -> Option<FTest> {
    let (b, m) = (with_v.len(), tested.len());
    if b <= m {
        return None;
    }
    let p = with_v[0].columns() / 2;
    let blocks: Vec<Factor> = with_v.iter().map(|f| f.select(&augmented(p, tested))).collect();
    let solution = ols(&Factor::merge(&blocks.iter().collect::<Vec<_>>()));
    if !solution.dropped.is_empty() {
        return None;
    }
    let covariance = least_squares_jackknife(&blocks, &solution.x)?.covariance;
    let own = Mat::from_fn(m, m, |i, j| covariance[(p + i, p + j)]);
    let delta = Mat::from_fn(m, 1, |i, _| solution.x[p + i]);
    let weighted = own.pivoted_qr().solve(&delta);
    let wald: f64 = (0..m).map(|i| delta[(i, 0)] * weighted[(i, 0)]).sum();
    let freedom = (m as f64, (b - m) as f64);
    let statistic = wald * freedom.1 / (freedom.0 * (b - 1) as f64);
    Some(FTest { statistic, freedom, p_value: f_exceedance(statistic, freedom.0, freedom.1)? })
}

fn effects(
    blocks: &[Factor],
    merged: &Factor,
    oblique: &Oblique,
    sizes: &[f64],
    settings: &ExogeneitySettings,
) -> Vec<Effect> {
    let p = oblique.kept.len();
    let of_w: Vec<usize> = (p..2 * p).collect();
    let least_squares = ols(&merged.select(&of_w));
    let instruments = oblique.solution();
    let w_blocks: Vec<Factor> = blocks.iter().map(|b| b.select(&of_w)).collect();
    let variance = |found: Option<crate::covariance::Jackknife>, factor: &Factor| -> Vec<f64> {
        let covariance = found.map_or_else(|| gram_inverse(&factor.r_matrix()), |j| j.covariance);
        (0..p).map(|i| covariance[(i, i)].max(0.0)).collect()
    };
    let of_ls = variance(least_squares_jackknife(&w_blocks, &least_squares.x), &least_squares.factor);
    let of_iv = variance(jackknife(blocks, &instruments.x), &oblique.fitted);
    (0..p)
        .map(|k| {
            let column = oblique.kept[k];
            let robust = 2.0 * of_ls[k].max(of_iv[k]).sqrt();
            Effect {
                column,
                least_squares: least_squares.x[k],
                instruments: instruments.x[k],
                std: (of_ls[k].sqrt(), of_iv[k].sqrt()),
                limit: robust.max(settings.harmless * sizes[column]),
            }
        })
        .collect()
}
