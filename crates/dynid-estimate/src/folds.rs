//! Held-out error over contiguous folds of time blocks.

use dynid_factor::factor::Factor;
use rayon::prelude::*;
use std::ops::Range;

/// Settings of [`cross_validate`].
#[derive(Debug, Clone, PartialEq)]
pub struct FoldSettings {
    /// Number of folds; at most the number of blocks is used. Default 5.
    pub folds: usize,
    /// Blocks left out of the training set on each side of the held-out fold, because the filter leaks into
    /// them. Default 1.
    pub dropped_neighbours: usize,
}

impl Default for FoldSettings {
    fn default() -> Self {
        Self { folds: 5, dropped_neighbours: 1 }
    }
}

/// Outcome of one fold.
#[derive(Debug, Clone, PartialEq)]
pub struct Fold {
    /// Time blocks held out.
    pub held_out: Range<usize>,
    /// Estimate from the training blocks.
    pub x: Vec<f64>,
    /// Mean squared held-out error per group, `‖y - W x‖²/N`, effort²; `None` where the group has no row.
    pub errors: Vec<Option<f64>>,
}

/// Held-out error with its spread over folds.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldOutError {
    /// Mean over folds.
    pub mean: f64,
    /// Standard error of the mean, sample standard deviation over `√folds`; zero for a single fold.
    pub standard_error: f64,
}

/// Outcome of [`cross_validate`].
#[derive(Debug, Clone, PartialEq)]
pub struct CrossValidation {
    /// One entry per fold, in time order. Folds without training blocks are left out.
    pub folds: Vec<Fold>,
}

impl CrossValidation {
    /// Held-out error of one group over the folds that have rows of it; `None` if there are none.
    pub fn group_error(&self, group: usize) -> Option<HeldOutError> {
        held_out_error(self.folds.iter().filter_map(|f| f.errors[group]))
    }

    /// Held-out error in units of the variances, `mean_j e_j/σ_j²` over the groups present in each fold.
    ///
    /// Panics unless there is one variance per group.
    pub fn weighted_error(&self, variances: &[f64]) -> Option<HeldOutError> {
        held_out_error(self.folds.iter().filter_map(|fold| {
            assert_eq!(variances.len(), fold.errors.len(), "one variance per group");
            let present: Vec<f64> =
                fold.errors.iter().zip(variances).filter_map(|(e, v)| e.map(|e| e / v)).collect();
            (!present.is_empty()).then(|| present.iter().sum::<f64>() / present.len() as f64)
        }))
    }
}

pub(crate) fn held_out_error(errors: impl Iterator<Item = f64>) -> Option<HeldOutError> {
    let errors: Vec<f64> = errors.collect();
    let count = errors.len() as f64;
    if errors.is_empty() {
        return None;
    }
    let mean = errors.iter().sum::<f64>() / count;
    let spread = errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>();
    let standard_error = if errors.len() > 1 { (spread / (count - 1.0) / count).sqrt() } else { 0.0 };
    Some(HeldOutError { mean, standard_error })
}

/// Splits blocks `0..blocks` into contiguous folds whose sizes differ by at most one.
pub fn contiguous_folds(blocks: usize, folds: usize) -> Vec<Range<usize>> {
    let folds = folds.clamp(1, blocks.max(1));
    (0..folds).map(|k| k * blocks / folds..(k + 1) * blocks / folds).filter(|r| !r.is_empty()).collect()
}

/// Cross-validates an estimator on block factors.
///
/// `groups[j][b]`: unweighted factor of group `j` in time block `b`. `estimate` maps the training factors, one
/// per group, to `p` parameters (for example by [`crate::linear::wls`]). Samples are never touched again.
/// Panics unless every group has every block.
pub fn cross_validate(
    groups: &[Vec<Factor>],
    settings: &FoldSettings,
    estimate: impl Fn(&[Factor]) -> Vec<f64> + Sync,
) -> CrossValidation {
    let blocks = groups.first().map_or(0, Vec::len);
    assert!(groups.iter().all(|g| g.len() == blocks), "every group has every time block");
    let folds = contiguous_folds(blocks, settings.folds)
        .into_par_iter()
        .filter_map(|held_out| {
            let gap_start = held_out.start.saturating_sub(settings.dropped_neighbours);
            let gap_end = (held_out.end + settings.dropped_neighbours).min(blocks);
            if gap_start == 0 && gap_end == blocks {
                return None;
            }
            let training: Vec<Factor> = groups
                .iter()
                .map(|g| Factor::merge(&g[..gap_start].iter().chain(&g[gap_end..]).collect::<Vec<_>>()))
                .collect();
            let x = estimate(&training);
            let errors = groups.iter().map(|g| mean_squared_error(&g[held_out.clone()], &x)).collect();
            Some(Fold { held_out, x, errors })
        })
        .collect();
    CrossValidation { folds }
}

fn mean_squared_error(blocks: &[Factor], x: &[f64]) -> Option<f64> {
    let rows: usize = blocks.iter().map(Factor::rows).sum();
    (rows > 0).then(|| blocks.iter().map(|b| b.rss(x)).sum::<f64>() / rows as f64)
}
