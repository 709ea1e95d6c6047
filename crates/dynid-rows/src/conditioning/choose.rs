//! Kernel, reversal mask and delay, chosen on held-out time blocks.

use dynid_motion::cutoff::{KernelLimit, kernel_candidates, kernel_limit};
use dynid_motion::median::median;
use dynid_motion::spectrum::PositionNoise;
use rayon::prelude::*;

use super::trial::{Choice, PROBES, Trial};
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// One kernel that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct KernelTrial {
    /// Cut-off, Hz.
    pub kernel_hz: f64,
    /// Held-out loss relative to the best, with linear friction.
    pub loss: f64,
    /// Held-out loss relative to the best, with a rich friction model.
    pub loss_rich: f64,
}

/// One rung of the reversal ladder, the same for all joints.
#[derive(Debug, Clone, PartialEq)]
pub struct MaskTrial {
    /// Share of the rms speed; `None`: no mask.
    pub level: Option<f64>,
    /// Mean held-out loss over time blocks, relative to the smallest of the ladder.
    pub loss: f64,
    /// Standard error of that mean over time blocks.
    pub standard_error: f64,
    /// Share of samples that stay usable, mean over joints.
    pub kept: f64,
}

/// Delay of the motion behind the logged effort.
#[derive(Debug, Clone, PartialEq)]
pub struct DelayEstimate {
    /// Used, samples.
    pub samples: f64,
    /// Half width of the 95 % interval, samples.
    pub half_width: f64,
    /// Per output: delay and its standard error, samples.
    pub per_output: Vec<(f64, f64)>,
    /// Disagreement of the outputs: χ² per degree of freedom. `None` with one output.
    pub chi_squared: Option<f64>,
    /// The estimate ran into a limit of the search: a warning, not a value.
    pub at_limit: bool,
    /// Given by the user instead of found.
    pub given: bool,
}

/// Highest kernel that noise and band allow: of what all logs together show of every joint, so that a log in which a joint stands or creeps
/// takes no part of the motion of others away. Logs with a stated period, whose states hold next to no noise, count apart; the lower
/// of both holds.
pub(crate) fn limit(
    logs: &[PreparedLog],
    settings: &ConditioningSettings,
) -> Result<KernelLimit, ConditioningError> {
    let of = |periodic: bool| {
        let logs: Vec<&PreparedLog> = logs.iter().filter(|log| log.periodic.is_some() == periodic).collect();
        let rate_hz = logs.iter().map(|log| log.rate_hz).fold(f64::INFINITY, f64::min);
        let outputs = logs.first().map_or(0, |log| log.position_noise.len());
        let pooled = |output: usize| {
            let records: Vec<_> =
                logs.iter().map(|log| (log.duration(), log.position_noise[output])).collect();
            PositionNoise::pooled(&records, settings.noise.noise_power)
        };
        let noise: Vec<PositionNoise> = (0..outputs).filter_map(pooled).collect();
        let mut limit = kernel_limit(&noise, rate_hz, &settings.cutoff)?;
        if periodic {
            let most = settings.cutoff.kernel_rate * rate_hz;
            limit.limit_hz = limit.limit_hz.max(settings.periodic_kernel_hz.min(most));
        }
        Some(limit)
    };
    let lowest = [of(false), of(true)].into_iter().flatten().min_by(|a, b| a.limit_hz.total_cmp(&b.limit_hz));
    lowest.ok_or_else(|| ConditioningError::NothingMoves {
        log: logs.first().map_or_else(String::new, |l| l.name.clone()),
    })
}

/// Candidates for the widest kernel, highest cut-off first.
pub(crate) fn candidates(limit: &KernelLimit, settings: &ConditioningSettings) -> Vec<f64> {
    settings.kernel_hz.map_or_else(|| kernel_candidates(limit, &settings.cutoff), |f| vec![f])
}

/// Limits of the delay search, samples.
pub(crate) fn delay_limits(logs: &[PreparedLog], settings: &ConditioningSettings) -> (f64, f64) {
    let rate = logs.iter().map(|l| l.rate_hz).fold(0.0, f64::max);
    match settings.delay_samples {
        Some(d) => (d, d),
        None => (-2.0, (0.02 * rate).max(3.0)),
    }
}

/// Gauss-Newton on the delay; per-output values with jackknife errors, pooled with the prior.
pub(crate) fn delay(
    trial: &Trial,
    rung: &[usize],
    shapes: &[Vec<usize>],
    limits: (f64, f64),
    settings: &ConditioningSettings,
    start: f64,
) -> DelayEstimate {
    let outputs = trial.outputs();
    if let Some(d) = settings.delay_samples {
        return DelayEstimate {
            samples: d,
            half_width: 0.0,
            per_output: vec![(d, 0.0); outputs],
            chi_squared: None,
            at_limit: false,
            given: true,
        };
    }
    let (prior, prior_sd) = settings.delay_prior;
    let mut at = start;
    let mut out = None;
    for _ in 0..6 {
        let choice = Choice { rung: rung.to_vec(), delay: at, shapes: shapes.to_vec(), free_delay: true };
        let rests = trial.delay_rests(&choice, None);
        let folds = trial.folds() as f64;
        let without: Vec<Vec<f64>> =
            (0..trial.folds()).into_par_iter().map(|b| trial.delay_rests(&choice, Some(b))).collect();
        let per_output: Vec<(f64, f64)> = (0..outputs)
            .map(|j| {
                let mean = without.iter().map(|w| w[j]).sum::<f64>() / folds;
                let spread: f64 = without.iter().map(|w| (w[j] - mean).powi(2)).sum();
                // A joint without rows has neither a rest nor a spread: its error must be large, not zero.
                let seen = rests[j] != 0.0 && spread > 0.0;
                let error = if seen { ((folds - 1.0) / folds * spread).sqrt() } else { 1e3 };
                (at + rests[j], error.max(1e-4))
            })
            .collect();
        let mut weight = 1.0 / (prior_sd * prior_sd);
        let mut sum = prior * weight;
        for (d, s) in &per_output {
            weight += 1.0 / (s * s);
            sum += d / (s * s);
        }
        let pooled = sum / weight;
        let chi_squared = (outputs > 1).then(|| {
            let chi: f64 = per_output.iter().map(|(d, s)| ((d - pooled) / s).powi(2)).sum();
            chi / (outputs - 1) as f64
        });
        let next = pooled.clamp(limits.0, limits.1);
        // One step may not leave the region where the linearisation is worth anything.
        let step = (next - at).clamp(-4.0 * trial.lags.step as f64, 4.0 * trial.lags.step as f64);
        out = Some(DelayEstimate {
            samples: at + step,
            half_width: 1.96 / weight.sqrt() * chi_squared.unwrap_or(1.0).max(1.0).sqrt(),
            per_output,
            chi_squared,
            at_limit: pooled < limits.0 || pooled > limits.1,
            given: false,
        });
        at += step;
        if step.abs() < 0.003 {
            break;
        }
    }
    out.unwrap_or_else(|| unreachable!("the loop runs at least once"))
}

/// Mean over outputs of the held-out mean squares, each relative to its reference, per time block.
fn losses(
    trial: &Trial,
    choice: &Choice,
    scorer: (&Trial, &Choice),
    rows_at: &[usize],
    reference: &[f64],
) -> Vec<f64> {
    (0..trial.folds())
        .into_par_iter()
        .filter_map(|fold| {
            let x = trial.fit(choice, Some(fold));
            let scores = scorer.0.score(scorer.1, &x, rows_at, fold);
            mean_ratio(&scores, reference)
        })
        .collect()
}

fn mean_ratio(scores: &[Option<f64>], reference: &[f64]) -> Option<f64> {
    let ratios: Vec<f64> =
        scores.iter().zip(reference).filter_map(|(s, r)| s.map(|s| s / r.max(f64::MIN_POSITIVE))).collect();
    (!ratios.is_empty()).then(|| ratios.iter().sum::<f64>() / ratios.len() as f64)
}

/// Mean squares of a fit on all rows it is scored on: the scale that losses are measured in.
fn reference(trial: &Trial, choice: &Choice, rows_at: &[usize]) -> Vec<f64> {
    let x = trial.fit(choice, None);
    let mut sums = vec![(0.0, 0usize); trial.outputs()];
    for fold in 0..trial.folds() {
        for (sum, score) in sums.iter_mut().zip(trial.score(choice, &x, rows_at, fold)) {
            if let Some(s) = score {
                sum.0 += s;
                sum.1 += 1;
            }
        }
    }
    sums.iter().map(|(s, n)| if *n > 0 { s / *n as f64 } else { 1.0 }).collect()
}

pub(crate) fn mean(v: &[f64]) -> f64 {
    v.iter().sum::<f64>() / v.len().max(1) as f64
}

/// Standard error of the mean.
pub(crate) fn error(v: &[f64]) -> f64 {
    let (m, n) = (mean(v), v.len() as f64);
    (v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / (n * (n - 1.0)).max(1.0)).sqrt()
}

/// Whether losses per time block fall by more than `sigmas` standard errors and more than `share` of themselves.
pub(crate) fn wins(from: &[f64], to: &[f64], sigmas: f64, share: f64) -> bool {
    let gains: Vec<f64> = from.iter().zip(to).map(|(a, b)| a - b).collect();
    from.len() == to.len() && mean(&gains) > sigmas * error(&gains) && mean(&gains) > share * mean(from)
}

/// Index of the highest kernel that no held-out loss speaks against, and the losses of all.
pub(crate) fn kernel(
    trials: &[Trial],
    limits: (f64, f64),
    settings: &ConditioningSettings,
) -> (usize, Vec<KernelTrial>) {
    if trials.len() == 1 {
        return (0, vec![KernelTrial { kernel_hz: trials[0].kernel_hz, loss: 1.0, loss_rich: 1.0 }]);
    }
    let scorer = &trials[trials.len() - 1];
    let strictest = settings.ladder.len();
    let rows_at: Vec<usize> =
        (0..scorer.outputs()).map(|j| scorer.allowed(j, strictest, settings.least_usable)).collect();
    let mut medians = [Vec::new(), Vec::new()];
    for (shapes, medians) in [0, PROBES].into_iter().zip(&mut medians) {
        let shapes: Vec<Vec<usize>> = vec![(0..shapes).collect(); scorer.outputs()];
        let with = |rung: &[usize], delay: f64| Choice {
            rung: rung.to_vec(),
            delay,
            shapes: shapes.clone(),
            free_delay: false,
        };
        let base = with(&rows_at, 0.5);
        let reference = reference(scorer, &base, &rows_at);
        for trial in trials {
            let rung: Vec<usize> =
                (0..trial.outputs()).map(|j| trial.allowed(j, strictest, settings.least_usable)).collect();
            let own = delay(trial, &rung, &shapes, limits, settings, 0.5).samples;
            let values =
                losses(trial, &with(&rung, own), (scorer, &with(&rows_at, own)), &rows_at, &reference);
            medians.push(median(&values).unwrap_or(f64::INFINITY));
        }
        let best = medians.iter().copied().fold(f64::INFINITY, f64::min);
        for m in medians.iter_mut() {
            *m /= best;
        }
    }
    let [plain, rich] = medians;
    let table: Vec<KernelTrial> = trials
        .iter()
        .zip(plain.iter().zip(&rich))
        .map(|(t, (p, r))| KernelTrial { kernel_hz: t.kernel_hz, loss: *p, loss_rich: *r })
        .collect();
    let passes = |k: &KernelTrial| k.loss.min(k.loss_rich) <= settings.kernel_veto;
    let chosen = table.iter().position(passes).unwrap_or(table.len() - 1);
    (chosen, table)
}

/// Rung of every output, and the ladder's losses with the same rung for all.
pub(crate) fn masks(
    trial: &Trial,
    delay: f64,
    settings: &ConditioningSettings,
) -> (Vec<usize>, Vec<MaskTrial>) {
    let outputs = trial.outputs();
    let rungs = settings.ladder.len() + 1;
    // Rows of a joint at rest hold friction of any size: of one that rests for long they, not the mask, have to prove their gain.
    let at = |rung: usize| -> Vec<usize> {
        let least = |j: usize| usize::from(trial.rests(j));
        (0..outputs).map(|j| trial.allowed(j, rung.max(least(j)), settings.least_usable)).collect()
    };
    // Losses are compared on rows that every rung has: those of the strictest one that keeps half of the samples.
    let rows_at: Vec<usize> = (0..outputs).map(|j| trial.allowed(j, rungs - 1, 0.5)).collect();
    let choice =
        |rung: Vec<usize>| Choice { rung, delay, shapes: vec![Vec::new(); outputs], free_delay: false };
    let reference = reference(trial, &choice(rows_at.clone()), &rows_at);
    let score = |rung: Vec<usize>| {
        let c = choice(rung);
        losses(trial, &c, (trial, &c), &rows_at, &reference)
    };

    if let Some(level) = settings.reversal_mask {
        let rung = |j: usize| match level < 0.0 {
            true => 0,
            false => trial.allowed(j, rungs - 1, settings.least_usable),
        };
        return ((0..outputs).map(rung).collect(), Vec::new());
    }
    let ladder: Vec<Vec<f64>> = (0..rungs).map(|r| score(at(r))).collect();
    let smallest = ladder.iter().map(|l| mean(l)).fold(f64::INFINITY, f64::min).max(f64::MIN_POSITIVE);
    // Rows are worth keeping: a stricter rung has to prove its gain, block by block.
    let wins = |from: &[f64], to: &[f64], sigmas: f64| wins(from, to, sigmas, settings.mask_gain);
    let best = (1..rungs)
        .fold(0, |best, r| if wins(&ladder[best], &ladder[r], settings.mask_sigma.0) { r } else { best });
    let table = (0..rungs)
        .map(|r| MaskTrial {
            level: (r > 0).then(|| settings.ladder[r - 1]),
            loss: mean(&ladder[r]) / smallest,
            standard_error: error(&ladder[r]) / smallest,
            kept: (0..outputs).map(|j| trial.coverage[j][r]).sum::<f64>() / outputs.max(1) as f64,
        })
        .collect();

    let mut current = at(best);
    let mut current_losses = ladder[best].clone();
    if (0..outputs).any(|j| trial.rests(j)) {
        let with_rest = vec![0; outputs];
        let values = score(with_rest.clone());
        if wins(&current_losses, &values, settings.mask_sigma.0) {
            current = with_rest;
            current_losses = values;
        }
    }
    for output in 0..outputs {
        for rung in 0..rungs {
            let allowed = trial.allowed(output, rung, settings.least_usable);
            if allowed != rung || rung == current[output] {
                continue;
            }
            let mut changed = current.clone();
            changed[output] = rung;
            let values = score(changed.clone());
            if wins(&current_losses, &values, settings.mask_sigma.1) {
                current = changed;
                current_losses = values;
            }
        }
    }
    (current, table)
}

/// Rungs once more, with friction shapes in the fit: joint by joint from `rung`, losses on all rows off reversal. Outputs that are `held` keep
/// theirs.
pub(crate) fn masks_again(
    trial: &Trial,
    rung: &[usize],
    shapes: &[Vec<usize>],
    held: &[bool],
    delay: f64,
    settings: &ConditioningSettings,
) -> Vec<usize> {
    let outputs = trial.outputs();
    let rungs = settings.ladder.len() + 1;
    let rows_at: Vec<usize> = (0..outputs).map(|j| trial.allowed(j, 1, settings.least_usable)).collect();
    let choice = |rung: Vec<usize>| Choice { rung, delay, shapes: shapes.to_vec(), free_delay: false };
    let reference = reference(trial, &choice(rung.to_vec()), &rows_at);
    let score = |rung: Vec<usize>| {
        let c = choice(rung);
        losses(trial, &c, (trial, &c), &rows_at, &reference)
    };
    let mut current = rung.to_vec();
    let mut current_losses = score(current.clone());
    let (sigmas, share) = settings.friction.mask_again;
    for output in (0..outputs).filter(|output| !held[*output]) {
        for rung in 1..rungs {
            if trial.allowed(output, rung, settings.least_usable) != rung || rung == current[output] {
                continue;
            }
            let mut changed = current.clone();
            changed[output] = rung;
            let values = score(changed.clone());
            if wins(&current_losses, &values, sigmas, share) {
                current = changed;
                current_losses = values;
            }
        }
    }
    current
}
