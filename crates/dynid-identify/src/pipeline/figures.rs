//! Figures of a fit, output by output.

use dynid_estimate::linear::{LinearEstimate, LinearMethod};
use dynid_rows::conditioning::{Conditioning, ReducedGroup};

use crate::advice::FitRows;
use crate::agreement::{Agreement, explained_in_motion};
use crate::consistency::{self, Consistent};
use crate::trained_log::TrainedLog;

/// Share of an effort that a model must explain for its residual to count as noise: of its variance on every log
/// in which the joint moves, and of its mean square on held-out folds.
pub(crate) const EXPLAINED: f64 = 0.5;

/// Per output: whether the model explains its effort, on logs that move the joint and on held-out folds.
pub(crate) fn explained<'a>(
    agreements: impl Iterator<Item = &'a Agreement>,
    outputs: usize,
    consistent: &Consistent,
) -> Vec<bool> {
    let agreements: Vec<&Agreement> = agreements.collect();
    (0..outputs)
        .map(|j| {
            let logs = explained_in_motion(&agreements, j).into_iter();
            logs.chain(held_out_share(consistent, j)).all(|x| x >= EXPLAINED)
        })
        .collect()
}

/// Share of the mean square of an output that is explained on held-out folds; `None` without folds.
fn held_out_share(consistent: &Consistent, output: usize) -> Option<f64> {
    if consistent.held_out.folds.is_empty() {
        return None;
    }
    let share = |estimator| consistent.held_out.explained(estimator, output);
    // Whichever estimator does better: a log that is too short for one is no fault of the joint.
    share(consistency::UNCONSTRAINED).into_iter().chain(share(consistent.consistent())).reduce(f64::max)
}

/// How the fit counts rows, for motions that are proposed.
pub(super) fn fit_rows(
    fit: &LinearEstimate,
    row_rms: &[Option<f64>],
    conditioning: Option<&Conditioning>,
    kernel_hz: f64,
) -> FitRows {
    let outputs = row_rms.len();
    let sigma = (0..outputs)
        .map(|output| {
            if of_other_rows(fit, outputs) {
                return row_rms[output];
            }
            // Of several logs the noisiest decides.
            let own = fit.groups.iter().filter(|g| g.output == output && g.scale == 0 && g.rows > 0);
            own.map(|g| g.variance.sqrt()).reduce(f64::max)
        })
        .collect();
    FitRows {
        scales_hz: conditioning.map_or_else(|| vec![kernel_hz], |c| c.scales_hz.clone()),
        mask: conditioning.map_or_else(|| vec![None; outputs], |c| c.mask.clone()),
        sigma,
    }
}

/// Whether a fit is one of other rows than those of the efforts of `outputs`: of positions, or of efforts that others pooled.
fn of_other_rows(fit: &LinearEstimate, outputs: usize) -> bool {
    fit.method == LinearMethod::Cloe || fit.groups.iter().any(|g| g.output >= outputs)
}

/// Residual variances of groups of measured rows: those of the fit, or of what it leaves where it is one of other rows.
fn effort_variances(groups: &[ReducedGroup], fit: &LinearEstimate, outputs: usize) -> Vec<f64> {
    if of_other_rows(fit, outputs) {
        let of = |g: &ReducedGroup| g.merged(fit.x.len()).rss(&fit.x) / g.rows().max(1) as f64;
        return groups.iter().map(of).collect();
    }
    fit.groups.iter().map(|g| g.variance).collect()
}

pub(super) fn row_rms(groups: &[ReducedGroup], x: &[f64], columns: usize) -> Vec<Option<f64>> {
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    (0..outputs)
        .map(|output| {
            let (mut rss, mut rows) = (0.0, 0);
            for group in groups.iter().filter(|g| g.output == output) {
                rss += group.merged(columns).rss(x);
                rows += group.rows();
            }
            (rows > 0).then(|| (rss / rows as f64).sqrt())
        })
        .collect()
}

pub(super) fn residual_ratios(
    groups: &[ReducedGroup],
    fit: &LinearEstimate,
    logs: &[TrainedLog],
    kernel_hz: f64,
) -> Vec<Option<f64>> {
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    let spread = 0.265 / kernel_hz;
    let variances = effort_variances(groups, fit, outputs);
    (0..outputs)
        .map(|output| {
            let (mut found, mut expected) = (0.0, 0.0);
            for (k, group) in groups.iter().enumerate() {
                if group.output != output || group.scale != 0 || variances.len() != groups.len() {
                    continue;
                }
                let log = &logs[group.log];
                let noise = log.effort_noise[output];
                let passed = 1.0 / (2.0 * std::f64::consts::PI.sqrt() * spread * log.rate_hz);
                let rows = group.rows() as f64;
                found += rows * variances[k];
                expected += rows * noise * noise * passed;
            }
            // A pre-smoothed effort has no noise floor to compare with.
            (expected > 1e-10 * found && found > 0.0).then(|| (found / expected).sqrt())
        })
        .collect()
}
