//! Delete-a-block jackknife.

use crate::least_squares::ols;
use dynid_factor::factor::Factor;
use dynid_factor::rank::certainly_full_rank;
use dynid_linalg::Mat;
use dynid_linalg::triangular::symmetric_from;
use rayon::prelude::*;

/// Fewest time blocks for an honest interval; below 20 the interval deserves a warning.
pub const MIN_BLOCKS: usize = 10;

/// Weight of the fallback ridge, in unit columns, for blocks whose removal lowers the rank.
const FALLBACK_RIDGE: f64 = 1e-8;

/// Jackknife covariance and the changes it is made of.
#[derive(Debug, Clone, PartialEq)]
pub struct Jackknife {
    /// `V = (B-1)/B Σ_b d_b d_bᵀ`.
    pub covariance: Mat,
    /// `d_b = x_(−b) - x`: change of the estimate without block `b`.
    pub changes: Vec<Vec<f64>>,
    /// Blocks whose removal lowers the rank: some parameter is seen in that block only. Their `d_b` is that of a
    /// ridge of 1e-8 (unit columns) towards `x`, so the covariance understates those parameters.
    pub indispensable: Vec<usize>,
}

impl Jackknife {
    /// Number `B` of blocks; intervals use Student's t with `B - 1` degrees of freedom.
    pub fn blocks(&self) -> usize {
        self.changes.len()
    }

    /// Half widths `t_{(1+level)/2}(B-1) √V_ii` of intervals of the given level, e.g. 0.95.
    pub fn half_widths(&self, level: f64) -> Option<Vec<f64>> {
        let t = crate::distribution::t_quantile(0.5 * (1.0 + level), self.blocks() as f64 - 1.0)?;
        Some((0..self.covariance.nrows()).map(|i| t * self.covariance[(i, i)].sqrt()).collect())
    }
}

/// Jackknife over time blocks with fixed weights.
///
/// `blocks`: weighted factors, one per time block, all joints of a block merged, in independent columns. `x`: their joint least-squares solution. The `B`
/// reduced problems come from prefix and suffix merges, so none is obtained by subtraction.
/// `None` with fewer than two blocks; see [`MIN_BLOCKS`] for how many are enough.
///
/// Source: Efron & Stein 1981; Shao & Wu 1989 for blocks.
pub fn jackknife(blocks: &[Factor], x: &[f64]) -> Option<Jackknife> {
    jackknife_with(blocks, None, x)
}

/// Jackknife as by [`jackknife`], with rows that are never left out, such as those of a prior.
///
/// `x`: joint solution of the blocks and the fixed rows.
pub fn jackknife_with(blocks: &[Factor], fixed: Option<&Factor>, x: &[f64]) -> Option<Jackknife> {
    // Centred at x, the solution without a block is d_b itself, free of cancellation.
    let centred: Vec<Factor> = blocks.iter().map(|b| b.centred(x)).collect();
    let fixed = fixed.map(|f| f.centred(x));
    let norms = Factor::merge(&blocks.iter().chain(&fixed).collect::<Vec<_>>()).column_norms();
    leave_out(&centred, fixed.as_ref(), x.len(), |rest| change_without(rest, &norms))
}

/// Jackknife of an estimator that is not least squares: solved again without each block.
///
/// `refit` maps the merged factor of the remaining blocks to the estimate, or `None` where there is none: such a block
/// counts as indispensable and as no change, so the covariance understates.
pub fn jackknife_by(
    blocks: &[Factor],
    x: &[f64],
    refit: impl Fn(&Factor) -> Option<Vec<f64>> + Sync,
) -> Option<Jackknife> {
    leave_out(blocks, None, x.len(), |rest| match refit(rest) {
        Some(without) => (without.iter().zip(x).map(|(w, x)| w - x).collect(), false),
        None => (vec![0.0; x.len()], true),
    })
}

/// Jackknife of an estimator that takes more than one merged factor: solved again without each block, of which `blocks` tells the places.
///
/// `without`: the estimate without a block, `None` where there is none: such a block counts as indispensable and as no change, so the
/// covariance understates.
pub(crate) fn jackknife_of<T: Copy + Sync>(
    blocks: &[T],
    x: &[f64],
    without: impl Fn(T) -> Option<Vec<f64>> + Sync,
) -> Option<Jackknife> {
    if blocks.len() < 2 {
        return None;
    }
    let change = |block: &T| match without(*block) {
        Some(without) => (without.iter().zip(x).map(|(w, x)| w - x).collect(), false),
        None => (vec![0.0; x.len()], true),
    };
    Some(of_changes(blocks.par_iter().map(change).collect(), x.len()))
}

fn leave_out(
    blocks: &[Factor],
    fixed: Option<&Factor>,
    parameters: usize,
    change: impl Fn(&Factor) -> (Vec<f64>, bool) + Sync,
) -> Option<Jackknife> {
    let count = blocks.len();
    if count < 2 {
        return None;
    }
    let before = running_merges(fixed, blocks.iter());
    let mut after = running_merges(None, blocks.iter().rev());
    after.reverse();
    let outcomes: Vec<(Vec<f64>, bool)> =
        (0..count).into_par_iter().map(|b| change(&Factor::merge(&[&before[b], &after[b]]))).collect();
    Some(of_changes(outcomes, parameters))
}

fn of_changes(outcomes: Vec<(Vec<f64>, bool)>, parameters: usize) -> Jackknife {
    let count = outcomes.len();
    let indispensable = (0..count).filter(|&b| outcomes[b].1).collect();
    let changes: Vec<Vec<f64>> = outcomes.into_iter().map(|(change, _)| change).collect();
    let correction = (count - 1) as f64 / count as f64;
    let covariance =
        symmetric_from(parameters, |i, j| correction * changes.iter().map(|d| d[i] * d[j]).sum::<f64>());
    Jackknife { covariance, changes, indispensable }
}

/// Merges of the factors before each one: entry `b` holds the fixed rows and factors `0..b`.
pub(crate) fn running_merges<'a>(
    fixed: Option<&Factor>,
    factors: impl ExactSizeIterator<Item = &'a Factor>,
) -> Vec<Factor> {
    let mut merges = Vec::with_capacity(factors.len());
    let mut running = fixed.cloned();
    for factor in factors {
        let before = running.take().unwrap_or_else(|| Factor::empty(factor.columns()));
        running = Some(Factor::merge(&[&before, factor]));
        merges.push(before);
    }
    merges
}

pub(crate) fn change_without(rest: &Factor, norms: &[f64]) -> (Vec<f64>, bool) {
    if certainly_full_rank(rest) {
        return (rest.solve(), false);
    }
    let solution = ols(rest);
    if solution.dropped.is_empty() {
        return (solution.x, false);
    }
    let weights: Vec<f64> = norms.iter().map(|n| FALLBACK_RIDGE.sqrt() * n).collect();
    (ols(&rest.with_prior_rows(&weights, &vec![0.0; norms.len()])).x, true)
}
