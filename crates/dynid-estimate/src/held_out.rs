//! Several estimators on the same held-out folds of time.

use std::ops::Range;

use rayon::prelude::*;

use crate::folds::{FoldSettings, contiguous_folds};
use dynid_factor::factor::Factor;
use dynid_factor::groups::{ReducedGroup, time_blocks};

/// An estimator of all base parameters from the weighted factor of the training blocks.
pub type Estimator<'a> = dyn Fn(&Factor) -> Vec<f64> + Sync + 'a;

/// Errors of all estimators on one held-out fold.
#[derive(Debug, Clone, PartialEq)]
pub struct FoldErrors {
    /// Blocks held out, counted over all logs.
    pub held_out: Range<usize>,
    /// Per estimator and output: sum of squared residuals of the rows, effort².
    pub squares: Vec<Vec<f64>>,
    /// Per output: sum of the squared efforts of the rows.
    pub effort: Vec<f64>,
    /// Per output: number of rows.
    pub rows: Vec<usize>,
}

/// Outcome of [`compare`].
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Folds in time order; none with too few blocks.
    pub folds: Vec<FoldErrors>,
}

impl Comparison {
    /// Adds estimators that were run on the same folds behind those that are here.
    ///
    /// # Panics
    /// If the folds are others.
    pub fn append(&mut self, further: Comparison) {
        assert_eq!(self.folds.len(), further.folds.len(), "the folds are the same");
        for (own, further) in self.folds.iter_mut().zip(further.folds) {
            assert_eq!(own.held_out, further.held_out, "the folds are the same");
            own.squares.extend(further.squares);
        }
    }

    /// Root mean square residual of an estimator on an output over all folds, in the effort's unit; `None` without rows.
    pub fn rms(&self, estimator: usize, output: usize) -> Option<f64> {
        let rows: usize = self.folds.iter().map(|f| f.rows[output]).sum();
        let squares: f64 = self.folds.iter().map(|f| f.squares[estimator][output]).sum();
        (rows > 0).then(|| (squares / rows as f64).sqrt())
    }

    /// Standard error of [`Self::rms`] from the spread of the folds; `None` with fewer than two folds with rows.
    pub fn rms_standard_error(&self, estimator: usize, output: usize) -> Option<f64> {
        let each: Vec<f64> = self
            .folds
            .iter()
            .filter(|f| f.rows[output] > 0)
            .map(|f| (f.squares[estimator][output] / f.rows[output] as f64).sqrt())
            .collect();
        let n = each.len() as f64;
        let mean = each.iter().sum::<f64>() / n;
        let spread: f64 = each.iter().map(|e| (e - mean).powi(2)).sum();
        (each.len() > 1).then(|| (spread / (n - 1.0) / n).sqrt())
    }

    /// Mean over outputs of an estimator's sum of squared residuals, relative to that of another; `None` without folds or
    /// where the other fits exactly.
    pub fn loss(&self, estimator: usize, reference: usize) -> Option<f64> {
        let outputs = self.folds.first()?.rows.len();
        let sum = |e: usize, j: usize| -> f64 { self.folds.iter().map(|f| f.squares[e][j]).sum() };
        let ratios: Vec<f64> = (0..outputs)
            .filter(|j| sum(reference, *j) > 0.0)
            .map(|j| sum(estimator, j) / sum(reference, j))
            .collect();
        (!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64)
    }

    /// Share of the mean square effort of an output that an estimator explains, `1 - ‖residual‖²/‖effort‖²`; `None` without
    /// effort.
    pub fn explained(&self, estimator: usize, output: usize) -> Option<f64> {
        let squares: f64 = self.folds.iter().map(|f| f.squares[estimator][output]).sum();
        let effort: f64 = self.folds.iter().map(|f| f.effort[output]).sum();
        (effort > 0.0).then(|| 1.0 - squares / effort)
    }

    /// Relative error of an estimator over all outputs and folds, `‖residual‖/‖effort‖`; `None` without effort.
    pub fn relative(&self, estimator: usize) -> Option<f64> {
        let squares: f64 = self.folds.iter().flat_map(|f| &f.squares[estimator]).sum();
        let effort: f64 = self.folds.iter().flat_map(|f| &f.effort).sum();
        (effort > 0.0).then(|| (squares / effort).sqrt())
    }
}

/// Runs every estimator on every fold.
///
/// `groups`: factors of all groups and time blocks, of the rows as they are; `training`: the same as the estimator weighs
/// rows within a group (such as [`crate::linear::LinearEstimate::reduced`]), which differs for robust losses; `weights`: one
/// per group, fixed; `total`: number of base columns. Blocks are counted over all logs, those next to a fold are left out
/// of its training set as [`FoldSettings::dropped_neighbours`] says. Residuals are of the rows as they are.
///
/// # Panics
/// Unless there is one weight per group, and both lists have the same groups and blocks.
pub fn compare(
    groups: &[ReducedGroup],
    training: &[ReducedGroup],
    weights: &[f64],
    total: usize,
    settings: &FoldSettings,
    estimators: &[&Estimator<'_>],
) -> Comparison {
    let blocks = time_blocks(training, weights, total);
    let places = places(training);
    assert_eq!(blocks.len(), places.len(), "time blocks are the blocks with rows, log after log");
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    let folds = contiguous_folds(blocks.len(), settings.folds)
        .into_par_iter()
        .filter_map(|held_out| {
            let start = held_out.start.saturating_sub(settings.dropped_neighbours);
            let end = (held_out.end + settings.dropped_neighbours).min(blocks.len());
            if start == 0 && end == blocks.len() {
                return None;
            }
            let training = Factor::merge(&blocks[..start].iter().chain(&blocks[end..]).collect::<Vec<_>>());
            let estimates: Vec<Vec<f64>> = estimators.iter().map(|e| e(&training)).collect();
            let mut errors = FoldErrors {
                squares: vec![vec![0.0; outputs]; estimators.len()],
                effort: vec![0.0; outputs],
                rows: vec![0; outputs],
                held_out: held_out.clone(),
            };
            for group in groups {
                let own: Vec<Vec<f64>> =
                    estimates.iter().map(|x| group.columns.iter().map(|c| x[*c]).collect()).collect();
                for (log, block) in &places[held_out.clone()] {
                    let Some(factor) = group.blocks.get(*block).filter(|_| *log == group.log) else {
                        continue;
                    };
                    errors.effort[group.output] += factor.effort_norm().powi(2);
                    errors.rows[group.output] += factor.rows();
                    for (squares, x) in errors.squares.iter_mut().zip(&own) {
                        squares[group.output] += factor.rss(x);
                    }
                }
            }
            Some(errors)
        })
        .collect();
    Comparison { folds }
}

/// Log and block index of every block with rows, log after log.
fn places(groups: &[ReducedGroup]) -> Vec<(usize, usize)> {
    let logs = groups.iter().map(|g| g.log + 1).max().unwrap_or(0);
    let mut out = Vec::new();
    for log in 0..logs {
        let of_log = || groups.iter().filter(move |g| g.log == log);
        let blocks = of_log().map(|g| g.blocks.len()).max().unwrap_or(0);
        out.extend(
            (0..blocks)
                .filter(|b| of_log().any(|g| g.blocks.get(*b).is_some_and(|f| f.rows() > 0)))
                .map(|b| (log, b)),
        );
    }
    out
}
