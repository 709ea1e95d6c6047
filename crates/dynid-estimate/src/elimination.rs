//! Backward elimination of parameters the data do not ask for.

mod prune;

pub use prune::{PruneSettings, PruneStep, Pruning, prune};

use crate::folds::HeldOutError;
use crate::least_squares::{LinearSolution, ols};
use dynid_factor::factor::Factor;

/// One model on the path of [`backward_elimination`].
#[derive(Debug, Clone, PartialEq)]
pub struct PathStep {
    /// Columns of the model, ascending.
    pub columns: Vec<usize>,
    /// Parameters of [`Self::columns`].
    pub x: Vec<f64>,
    /// Residual sum of squares, in the unit of the (weighted) factor.
    pub rss: f64,
    /// `BIC = N_eff ln(rss/N) + k ln N_eff`; minus infinity for an exact fit.
    pub bic: f64,
    /// Column with the least statistic, the next to go.
    pub weakest: usize,
    /// Statistic `F` of that column; infinite for an exact fit.
    pub statistic: f64,
}

/// By how much the rss rises when one parameter is removed, `Δ_i = x_i²/C_ii`, exactly.
///
/// One value per kept column of the solution, in that order.
pub fn rss_increase(solution: &LinearSolution) -> Vec<f64> {
    let covariance = solution.unit_covariance();
    solution.kept.iter().enumerate().map(|(k, &c)| solution.x[c].powi(2) / covariance[(k, k)]).collect()
}

/// Path of models from all independent columns down to one, dropping the column of least
/// `F_i = Δ_i/σ̂²`, `σ̂² = rss/(N - k)`.
///
/// `factor`: the weighted factor; columns that are dependent or unexcited are left out from the start.
/// `effective_rows`: `N_eff = N/κ`, see [`crate::covariance::variance_inflation`]; with `N` itself nothing is ever
/// pruned from a filtered log. Each step re-triangularises, so errors do not build up.
///
/// Stop where every `F` exceeds [`crate::distribution::f_quantile`]`(0.95, 1, B - 1)`, or choose with
/// [`within_one_standard_error`]. A dropped base parameter is not a zero standard parameter.
pub fn backward_elimination(factor: &Factor, effective_rows: f64) -> Vec<PathStep> {
    backward_elimination_with(factor, effective_rows, |_, solution| {
        let freedom = solution.rows as f64 - solution.kept.len() as f64;
        let variance = solution.rss / freedom.max(1.0);
        rss_increase(solution)
            .into_iter()
            .map(|d| if variance > 0.0 { d / variance } else { f64::INFINITY })
            .collect()
    })
}

/// Elimination as by [`backward_elimination`] with another statistic, such as the Wald form `F_i = x_i²/V_ii` with a robust `V`.
///
/// `statistics(columns, solution)` is given the columns of the model (in the numbering of `factor`) and its
/// solution (numbered within the model), and returns one value per column.
pub fn backward_elimination_with(
    factor: &Factor,
    effective_rows: f64,
    statistics: impl Fn(&[usize], &LinearSolution) -> Vec<f64>,
) -> Vec<PathStep> {
    let mut columns = ols(factor).kept;
    let mut path = Vec::with_capacity(columns.len());
    let mut current = factor.select(&columns);
    while !columns.is_empty() {
        let solution = ols(&current);
        if !solution.dropped.is_empty() {
            // Independent columns stay so when others leave; a rank at the edge of the tolerance may still flip.
            columns = solution.kept.iter().map(|&k| columns[k]).collect();
            current = factor.select(&columns);
            continue;
        }
        let values = statistics(&columns, &solution);
        assert_eq!(values.len(), columns.len(), "one statistic per column");
        let weakest = (0..columns.len()).min_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0);
        path.push(PathStep {
            bic: bayesian_information(
                solution.rss / solution.rows as f64,
                solution.kept.len(),
                effective_rows,
            ),
            x: solution.x,
            rss: solution.rss,
            weakest: columns[weakest],
            statistic: values[weakest],
            columns: columns.clone(),
        });
        columns.remove(weakest);
        current = factor.select(&columns);
    }
    path
}

/// `N_eff ln(rss/N) + k ln N_eff`.
fn bayesian_information(mean_square: f64, parameters: usize, effective_rows: f64) -> f64 {
    effective_rows * mean_square.ln() + parameters as f64 * effective_rows.ln()
}

/// Index of the smallest model within one standard error of the least held-out error.
///
/// `errors`: held-out error of each step of the path, `None` where there is none. `None` if all are.
///
/// Source: Breiman et al. 1984 (one-standard-error rule).
pub fn within_one_standard_error(path: &[PathStep], errors: &[Option<HeldOutError>]) -> Option<usize> {
    smallest_within_one_standard_error(&errors[..errors.len().min(path.len())], |i| path[i].columns.len())
}

fn smallest_within_one_standard_error(
    errors: &[Option<HeldOutError>],
    size: impl Fn(usize) -> usize,
) -> Option<usize> {
    let known = || errors.iter().enumerate().filter_map(|(i, e)| e.as_ref().map(|e| (i, e)));
    let (_, best) = known().min_by(|a, b| a.1.mean.total_cmp(&b.1.mean))?;
    let limit = best.mean + best.standard_error;
    known().filter(|(_, e)| e.mean <= limit).min_by_key(|(i, _)| size(*i)).map(|(i, _)| i)
}
