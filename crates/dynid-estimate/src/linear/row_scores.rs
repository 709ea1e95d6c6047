//! Scores of the rows in time order, for the HAC covariance of a fit that is known by its factors only.

use super::LinearEstimate;
use crate::covariance::{hac_bartlett_logs, hac_lag};
use dynid_factor::factor::FactorError;
use dynid_factor::rows::{RowSource, RowVisitor, Rows, RowsError, visit_all};
use dynid_linalg::Mat;

/// Scores `s_k = Σ_j W_jkᵀ ψ_jk/σ_j` of all joints and kernel scales in equal steps of time.
#[derive(Debug, Clone, PartialEq)]
pub struct RowScores {
    /// Per log, in ascending order of the logs' indices: steps × kept columns. Steps without a row are zero.
    pub logs: Vec<Mat>,
    /// Per log: length of a step in samples, the spacing of the rows of the widest kernel.
    pub step: Vec<usize>,
}

impl RowScores {
    /// Bartlett HAC covariance `C Ω C T/(T - p)` of the kept columns, a second opinion beside the jackknife.
    ///
    /// `rate_hz`: sample rate of each log; `cut_off`: of the widest kernel, Hz. The lag is [`hac_lag`] at the rate of the
    /// steps. `None` with fewer steps than columns. Panics unless there is one rate per log.
    pub fn covariance(&self, estimate: &LinearEstimate, rate_hz: &[f64], cut_off: f64) -> Option<Mat> {
        assert_eq!(rate_hz.len(), self.logs.len(), "one sample rate per log");
        let lags: Vec<usize> = rate_hz
            .iter()
            .zip(&self.step)
            .map(|(rate, step)| hac_lag(rate / *step as f64, cut_off))
            .collect();
        hac_bartlett_logs(&self.logs, &estimate.solution.unit_covariance(), &lags)
    }
}

struct ScoreVisitor<'a> {
    estimate: &'a LinearEstimate,
    group: usize,
    x: Vec<f64>,
    run: Vec<f64>,
    samples: Vec<usize>,
    /// One run of `columns` numbers per row.
    scores: Vec<f64>,
    step: usize,
}

impl RowVisitor for ScoreVisitor<'_> {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        rows.residuals(&self.x, &mut self.run);
        for (i, residual) in self.run.iter().enumerate() {
            let sample = rows.samples[i];
            if let Some(before) = self.samples.last() {
                self.step = self.step.min((sample - before).max(1));
            }
            self.samples.push(sample);
            let share = self.estimate.row_score(self.group, *residual);
            let columns = self.x.len();
            self.scores.extend((0..columns).map(|c| rows.regressor[c * rows.stride + i] * share));
        }
        Ok(())
    }
}

/// Scores of all rows at an estimate by least squares, weighted, ridge or robust.
///
/// `source`: the rows the estimate was made from. Rows of narrower kernels lie closer and are summed within a step.
/// For total least squares the scores lack the part of the columns' errors; use its block sandwich.
///
/// # Errors
/// [`RowsError`] of the source.
///
/// # Panics
/// Unless the source holds the groups of the estimate.
pub fn row_scores(source: &dyn RowSource, estimate: &LinearEstimate) -> Result<RowScores, RowsError> {
    let shapes = source.groups();
    assert_eq!(shapes.len(), estimate.groups.len(), "the rows are those of the estimate");
    let mut visitors: Vec<ScoreVisitor<'_>> = shapes
        .iter()
        .enumerate()
        .map(|(group, shape)| ScoreVisitor {
            estimate,
            group,
            x: shape.columns.iter().map(|&c| estimate.x[c]).collect(),
            run: Vec::new(),
            samples: Vec::new(),
            scores: Vec::new(),
            step: usize::MAX,
        })
        .collect();
    visit_all(source, &mut visitors)?;

    let kept = &estimate.solution.kept;
    let mut indices: Vec<usize> = shapes.iter().map(|s| s.log).collect();
    indices.sort_unstable();
    indices.dedup();
    let (mut logs, mut steps) = (Vec::new(), Vec::new());
    for log in indices {
        let own = || visitors.iter().zip(shapes).filter(|(v, s)| s.log == log && !v.samples.is_empty());
        let step = own().map(|(v, _)| v.step).filter(|s| *s != usize::MAX).max().unwrap_or(1);
        let first = own().filter_map(|(v, _)| v.samples.first()).min().copied().unwrap_or(0);
        let last = own().filter_map(|(v, _)| v.samples.last()).max().copied().unwrap_or(0);
        let mut sum = Mat::zeros((last - first) / step + 1, kept.len());
        for (visitor, shape) in own() {
            let width = shape.columns.len();
            let targets: Vec<Option<usize>> =
                shape.columns.iter().map(|c| kept.binary_search(c).ok()).collect();
            for (sample, scores) in visitor.samples.iter().zip(visitor.scores.chunks_exact(width)) {
                for (target, score) in targets.iter().zip(scores) {
                    if let Some(column) = target {
                        sum[((sample - first) / step, *column)] += score;
                    }
                }
            }
        }
        logs.push(sum);
        steps.push(step);
    }
    Ok(RowScores { logs, step: steps })
}
