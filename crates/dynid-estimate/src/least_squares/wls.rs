//! Weighted least squares with one residual variance per group of rows.

use super::ols::{LinearSolution, Solved, ols, solved};
use dynid_factor::factor::Factor;
use dynid_linalg::triangular::inverse;
use rayon::prelude::*;

/// Settings of [`wls`].
#[derive(Debug, Clone, PartialEq)]
pub struct WlsSettings {
    /// Stop when no `σ_j²` changes by more than this, relative. Default 1e-6.
    pub tolerance: f64,
    /// Most passes. Default 20; three to five are typical.
    pub max_passes: usize,
    /// Least `σ_j` as a share of the root mean square effort of the group, for logs without noise. Default 1e-9.
    pub floor: f64,
    /// Variances to start from, effort², one per group; empty: 1 for all. Default empty.
    pub start: Vec<f64>,
}

impl Default for WlsSettings {
    fn default() -> Self {
        Self { tolerance: 1e-6, max_passes: 20, floor: 1e-9, start: Vec::new() }
    }
}

/// What weighted least squares found about one group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupVariance {
    /// `σ_j² = rss_j/(N_j - ℓ_j)`, effort².
    pub variance: f64,
    /// Leverage `ℓ_j = ‖R_j R⁻¹‖_F²/σ_j²`; over all groups they sum to the rank.
    pub leverage: f64,
    /// Residual sum of squares of the group, effort².
    pub rss: f64,
    /// Rows `N_j`.
    pub rows: usize,
    /// Whether the variance could not be told from the residual: at the floor, or no row beyond the leverage.
    pub at_floor: bool,
}

/// Weighted least-squares estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct WlsEstimate {
    /// Solution of the merged factor weighted by `1/σ_j`; its rss is in units of the variances, and `C` of
    /// [`LinearSolution::unit_covariance`] is the model-based covariance.
    pub solution: LinearSolution,
    /// One entry per group, in the order given.
    pub groups: Vec<GroupVariance>,
    /// Passes made.
    pub passes: usize,
    /// Whether the variances settled within the tolerance.
    pub converged: bool,
    /// Merged weighted factor of all columns.
    pub factor: Factor,
}

impl WlsEstimate {
    /// Weights `1/σ_j` per group.
    pub fn weights(&self) -> Vec<f64> {
        self.groups.iter().map(|g| 1.0 / g.variance.sqrt()).collect()
    }
}

/// Weighted least squares, `min Σ_j ‖y_j - W_j x‖²/σ_j²`, with variances estimated along the way.
///
/// `groups`: one factor per group (a joint, or a joint of one log), all in the same columns. Starting from
/// `σ_j = 1` (or [`WlsSettings::start`]), each pass solves the merged weighted factor and renews
/// `σ_j² = rss_j/(N_j - ℓ_j)` by the exact leverage of the group instead of a common `p/n`. A group without half a degree of freedom keeps its variance,
/// a group of zero effort takes its floor from the group of largest effort.
///
/// Panics on an empty list, unequal columns, or a start that is not one positive number per group. Rank deficiency is reported in the solution.
pub fn wls(groups: &[Factor], settings: &WlsSettings) -> WlsEstimate {
    let classes: Vec<usize> = (0..groups.len()).collect();
    wls_with(groups, &classes, None, settings)
}

/// Rows `(x - x0)_i/scale_i` that hold every solution near a prior, whatever the weights of the groups.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PriorRows {
    /// `√κ/scale_i`.
    pub(crate) weights: Vec<f64>,
    pub(crate) x0: Vec<f64>,
}

/// Weighted least squares as by [`wls`], groups of the same class sharing one variance, and with prior rows.
///
/// `classes`: one index below the number of groups per group.
pub(crate) fn wls_with(
    groups: &[Factor],
    classes: &[usize],
    prior: Option<&PriorRows>,
    settings: &WlsSettings,
) -> WlsEstimate {
    let mut variances =
        if settings.start.is_empty() { vec![1.0; groups.len()] } else { settings.start.clone() };
    assert_eq!(variances.len(), groups.len(), "length of the start");
    assert!(variances.iter().all(|v| v.is_finite() && *v > 0.0), "variances to start from: {variances:?}");
    let mut passes = 0;
    loop {
        let Solved { x, kept, factor } = solved_near(merge_weighted(groups, &variances), prior);
        let found = group_variances(groups, classes, &variances, (&x, &kept, &factor), settings.floor);
        passes += 1;
        let change = found
            .iter()
            .zip(&variances)
            .map(|(g, old)| (g.variance - old).abs() / g.variance)
            .fold(0.0, f64::max);
        let converged = change <= settings.tolerance;
        if converged || passes >= settings.max_passes {
            let variances: Vec<f64> = found.iter().map(|g| g.variance).collect();
            let factor = merge_weighted(groups, &variances);
            let solution = solve(&factor, prior);
            let of_kept = (&solution.x[..], &solution.kept[..], &solution.factor);
            let last = group_variances(groups, classes, &variances, of_kept, settings.floor);
            let groups = found
                .into_iter()
                .zip(last)
                .map(|(used, now)| GroupVariance { variance: used.variance, ..now })
                .collect();
            return WlsEstimate { solution, groups, passes, converged, factor };
        }
        variances = found.iter().map(|g| g.variance).collect();
    }
}

/// Least squares on a weighted factor, with the prior rows if there are any; the rss is that of the samples.
fn solve(factor: &Factor, prior: Option<&PriorRows>) -> LinearSolution {
    let Some(PriorRows { weights, x0 }) = prior else { return ols(factor) };
    let mut solution = ols(&factor.with_prior_rows(weights, x0).centred(x0));
    solution.x.iter_mut().zip(x0).for_each(|(d, x0)| *d += x0);
    let origin: Vec<f64> = solution.kept.iter().map(|&c| -x0[c]).collect();
    solution.factor = solution.factor.centred(&origin);
    solution.rss = factor.rss(&solution.x);
    solution
}

/// [`solve`] without its evidence.
fn solved_near(factor: Factor, prior: Option<&PriorRows>) -> Solved {
    let Some(PriorRows { weights, x0 }) = prior else { return solved(factor) };
    let mut solution = solved(factor.with_prior_rows(weights, x0).centred(x0));
    solution.x.iter_mut().zip(x0).for_each(|(d, x0)| *d += x0);
    solution
}

/// Merges groups weighted by `1/σ_j`, in the order given.
pub(crate) fn merge_weighted(groups: &[Factor], variances: &[f64]) -> Factor {
    let weighted: Vec<Factor> = groups.iter().zip(variances).map(|(f, v)| f.scaled(1.0 / v.sqrt())).collect();
    Factor::merge(&weighted.iter().collect::<Vec<_>>())
}

/// `(x, kept, factor)`: a solution, the columns behind it, and their factor.
fn group_variances(
    groups: &[Factor],
    classes: &[usize],
    variances: &[f64],
    (x, kept, factor): (&[f64], &[usize], &Factor),
    floor: f64,
) -> Vec<GroupVariance> {
    let inverse = inverse(&factor.r_matrix());
    let found: Vec<(f64, f64)> = groups
        .par_iter()
        .zip(variances)
        .map(|(group, variance)| {
            let product = group.select(kept).r_matrix() * &inverse;
            (product.norm_l2().powi(2) / variance, group.rss(x))
        })
        .collect();
    let least = floors(groups, classes, floor);
    let mut sums = vec![(0.0, 0.0); groups.len()];
    for ((group, (leverage, rss)), class) in groups.iter().zip(&found).zip(classes) {
        sums[*class].0 += rss;
        sums[*class].1 += group.rows() as f64 - leverage;
    }
    (0..groups.len())
        .map(|g| {
            let (rss, freedom) = sums[classes[g]];
            let estimate = if freedom >= 0.5 { rss / freedom } else { variances[g] };
            GroupVariance {
                variance: estimate.max(least[g]),
                leverage: found[g].0,
                rss: found[g].1,
                rows: groups[g].rows(),
                at_floor: freedom < 0.5 || estimate <= least[g],
            }
        })
        .collect()
}

/// Least variance of each group's class, `(floor · rms effort)²`; a class of zero effort takes that of the group of
/// largest effort.
pub(crate) fn floors(groups: &[Factor], classes: &[usize], floor: f64) -> Vec<f64> {
    let mut sums = vec![(0.0, 0); groups.len()];
    for (group, class) in groups.iter().zip(classes) {
        sums[*class].0 += group.effort_norm().powi(2);
        sums[*class].1 += group.rows();
    }
    let fallback = largest_effort(groups.iter());
    classes.iter().map(|class| least(sums[*class], fallback, floor)).collect()
}

/// Least variances, where every group is a class for itself.
pub(crate) fn group_floors(groups: &[&Factor], floor: f64) -> Vec<f64> {
    let fallback = largest_effort(groups.iter().copied());
    groups.iter().map(|g| least((g.effort_norm().powi(2), g.rows()), fallback, floor)).collect()
}

/// Mean square effort of the group of largest effort; 1 if there is none.
fn largest_effort<'a>(groups: impl Iterator<Item = &'a Factor>) -> f64 {
    match groups.map(|g| mean_square(g.effort_norm().powi(2), g.rows())).fold(0.0, f64::max) {
        0.0 => 1.0,
        largest => largest,
    }
}

fn least((energy, rows): (f64, usize), fallback: f64, floor: f64) -> f64 {
    let mean_square = match mean_square(energy, rows) {
        0.0 => fallback,
        positive => positive,
    };
    floor * floor * mean_square
}

fn mean_square(energy: f64, rows: usize) -> f64 {
    energy / rows.max(1) as f64
}
