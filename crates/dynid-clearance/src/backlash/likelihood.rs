//! Likelihood of gaps against none.

use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::mask::{dilate, near_reversal};
use dynid_motion::signal::rms;
use rayon::prelude::*;

use super::flight::{Trace, follow};
use super::noise::{Response, filtered, whitening};
use super::{BacklashSignals, Path};
use dynid_linalg::vector::{add_scaled, dot, norm};

/// Share of the rms speed below which a joint counts as reversing.
const REVERSAL: f64 = 0.1;
/// Least share of the residual's power that is taken for white: an effort that was low-passed before it was logged shows no
/// noise where it shows no gap either.
const WHITE: f64 = 0.01;
/// What borders on a reversal, s.
const REVERSAL_REACH: f64 = 0.03;

/// Number of [`regressors`].
const REGRESSORS: usize = 8;
/// Fewest crossings that make an estimate.
const CROSSINGS: usize = 6;

/// A gap to be tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Share of the friction that acts behind the transmission.
    pub(super) share: f64,
    /// Load at which flanks part.
    pub(super) level: f64,
    /// From flank to flank.
    pub(super) gap: f64,
}

/// How well a gap did.
#[derive(Debug, Clone, Copy)]
pub(super) struct Trial {
    pub(super) candidate: Candidate,
    pub(super) path: Path,
    /// Twice the log-likelihood ratio against no gap.
    pub(super) ratio: f64,
    pub(super) crossings: usize,
}

impl Trial {
    /// Whether the gap is crossed often enough to say anything.
    pub(super) fn told(&self) -> bool {
        self.crossings >= CROSSINGS
    }

    pub(super) fn share(&self) -> f64 {
        self.candidate.share
    }

    pub(super) fn evidence(&self) -> f64 {
        self.ratio.max(0.0).sqrt()
    }
}

/// What a sample of a trace does along a path to the whitened residual, of which only samples that are used count.
struct Effect {
    response: Response,
    /// Inner products with the residual and with each regressor, per sample of the trace.
    inner: Vec<[f64; 1 + REGRESSORS]>,
    /// Autocorrelation of the response: inner products of samples of the trace, per lag, where all of their responses count.
    products: Vec<f64>,
}

/// Whitened residual with what regressors explain of it taken out.
pub(super) struct Likelihood {
    effects: Vec<Effect>,
    /// Samples that count, away from reversals.
    pub(super) used: Vec<bool>,
    /// Samples before each that do not.
    unused: Vec<usize>,
    variance: f64,
    /// Root mean square of the residual below the cut-off of the states, where it counts.
    pub(super) slow_rms: f64,
}

impl Likelihood {
    /// `None` if fewer samples count than `fewest`, or no residual is left.
    pub(super) fn new(signals: &BacklashSignals<'_>, paths: &[Path], fewest: usize) -> Option<Self> {
        let n = signals.residual.len();
        let reversing = near_reversal(signals.velocity, REVERSAL * rms(signals.velocity));
        let away: Vec<bool> = (0..n).map(|k| reversing[k] || !signals.counted[k]).collect();
        let away = dilate(&away, (REVERSAL_REACH / signals.step_s).ceil() as usize);
        let masked: Vec<f64> = (0..n).map(|k| if away[k] { 0.0 } else { signals.residual[k] }).collect();
        let filter = whitening(&masked, signals.step_s);
        let used: Vec<bool> = (0..n).map(|k| !away[k] && k >= filter.len()).collect();
        let count = used.iter().filter(|u| **u).count();
        if count < fewest {
            return None;
        }
        let through = |signal: &[f64]| -> Vec<f64> {
            filtered(signal, &filter).iter().zip(&used).map(|(x, u)| if *u { *x } else { 0.0 }).collect()
        };
        let mut known: Vec<Vec<f64>> = Vec::new();
        for regressor in regressors(signals) {
            let mut column = through(&regressor);
            let before = norm(&column);
            take_out(&mut column, &known);
            let size = norm(&column);
            if size > 1e-6 * before {
                column.iter_mut().for_each(|x| *x /= size);
                known.push(column);
            }
        }
        let mut residual = through(signals.residual);
        take_out(&mut residual, &known);
        let power = |signal: &[f64]| signal.iter().map(|r| r * r).sum::<f64>() / count as f64;
        let variance = power(&residual).max(WHITE * power(&masked));
        if variance <= 0.0 {
            return None;
        }
        let effect = |path: &Path| {
            let response = Response::new(signals.state_hz, *path, signals.step_s, &filter);
            let mut inner = vec![[0.0; 1 + REGRESSORS]; n];
            for (i, column) in std::iter::once(&residual).chain(&known).enumerate() {
                for (row, product) in inner.iter_mut().zip(response.adjoint(column)) {
                    row[i] = product;
                }
            }
            Effect { inner, products: response.products(), response }
        };
        let mut unused = vec![0; n + 1];
        for k in 0..n {
            unused[k + 1] = unused[k] + usize::from(!used[k]);
        }
        Some(Likelihood {
            effects: paths.par_iter().map(effect).collect(),
            unused,
            variance,
            slow_rms: slow_rms(signals, &used),
            used,
        })
    }

    /// Every candidate with every loop, in order.
    pub(super) fn of(&self, signals: &BacklashSignals<'_>, candidates: &[Candidate]) -> Vec<Trial> {
        let n = signals.residual.len();
        candidates
            .par_iter()
            .map_init(
                || (vec![0.0; n], vec![0.0; n]),
                |(torque, buffer), candidate| {
                    for (t, (load, friction)) in
                        torque.iter_mut().zip(signals.load.iter().zip(signals.friction))
                    {
                        *t = load + candidate.share * friction - candidate.level;
                    }
                    let trace = follow(torque, signals.inertia, signals.step_s, candidate.gap);
                    let crossings = trace.crossings.iter().filter(|k| self.used[**k]).count();
                    self.effects
                        .iter()
                        .map(|effect| Trial {
                            candidate: *candidate,
                            path: effect.response.path,
                            ratio: self.ratio(&trace, effect, buffer),
                            crossings,
                        })
                        .collect::<Vec<_>>()
                },
            )
            .flatten_iter()
            .collect()
    }

    /// `(2 hᵀr - hᵀh)/σ²` of a trace `h`, what regressors explain taken out of it. `buffer`: zeros, and left so.
    fn ratio(&self, trace: &Trace, effect: &Effect, buffer: &mut [f64]) -> f64 {
        let n = buffer.len();
        let mut inner = [0.0; 1 + REGRESSORS];
        for (row, value) in &trace.samples {
            for (sum, product) in inner.iter_mut().zip(&effect.inner[*row]) {
                *sum += value * product;
            }
        }
        let mut power = -inner[1..].iter().map(|explained| explained * explained).sum::<f64>();
        let (lead, values) = (effect.response.lead, effect.response.values.as_slice());
        let mut rest = trace.samples.as_slice();
        while let Some((first, _)) = rest.first() {
            // What overlaps is summed before it is squared.
            let (start, mut end, mut taken) = (first.saturating_sub(lead), 0, 0);
            for (row, _) in rest {
                if taken > 0 && row.saturating_sub(lead) > end {
                    break;
                }
                end = (row + values.len()).saturating_sub(lead).min(n);
                taken += 1;
            }
            let (together, later) = rest.split_at(taken);
            rest = later;
            let all_used = *first >= lead && end < n && self.unused[end] == self.unused[start];
            power += if all_used {
                quadratic(together, &effect.products, buffer)
            } else {
                for (row, value) in together {
                    let before = lead.saturating_sub(*row);
                    let from = (row + before) - lead;
                    add_scaled(&mut buffer[from..n], *value, &values[before..]);
                }
                let squares = (start..end).map(|k| {
                    let h = std::mem::take(&mut buffer[k]);
                    if self.used[k] { h * h } else { 0.0 }
                });
                squares.sum()
            };
        }
        (2.0 * inner[0] - power) / self.variance
    }
}

/// `Σ v_i v_j c(|k_i - k_j|)` over samples `(k, v)` in order. `buffer`: zeros, and left so.
fn quadratic(samples: &[(usize, f64)], products: &[f64], buffer: &mut [f64]) -> f64 {
    let mut sum = 0.0;
    let mut last = 0;
    for (row, value) in samples.iter().rev() {
        last = last.max(*row);
        let later = &buffer[row + 1..last + 1];
        let reach = later.len().min(products.len() - 1);
        sum += value * (value * products[0] + 2.0 * dot(&later[..reach], &products[1..=reach]));
        buffer[*row] = *value;
    }
    samples.iter().for_each(|(row, _)| buffer[*row] = 0.0);
    sum
}

fn take_out(column: &mut [f64], known: &[Vec<f64>]) {
    for known in known {
        let along = dot(column, known);
        add_scaled(column, -along, known);
    }
}

/// Root mean square, over samples that are used, of the residual through the states' filter.
fn slow_rms(signals: &BacklashSignals<'_>, used: &[bool]) -> f64 {
    let slow = butterworth(4, signals.state_hz, 1.0 / signals.step_s)
        .and_then(|filter| forward_backward(&filter, signals.residual));
    let slow = slow.as_deref().unwrap_or(signals.residual);
    let counted: Vec<f64> = slow.iter().zip(used).filter(|(_, u)| **u).map(|(r, _)| *r).collect();
    rms(&counted)
}

/// What a residual may hold beside a gap: errors of load, delay and friction, and friction that follows the load, whose kink lies
/// where flanks part.
fn regressors(signals: &BacklashSignals<'_>) -> [Vec<f64>; REGRESSORS] {
    let n = signals.load.len();
    let rate: Vec<f64> =
        (0..n).map(|k| signals.load[(k + 1).min(n - 1)] - signals.load[k.saturating_sub(1)]).collect();
    let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
    let direction: Vec<f64> = signals.velocity.iter().map(|v| sign(*v)).collect();
    let size: Vec<f64> = signals.load.iter().map(|t| t.abs()).collect();
    let with_direction = size.iter().zip(&direction).map(|(t, d)| t * d).collect();
    [
        vec![1.0; n],
        signals.load.to_vec(),
        rate,
        signals.friction.to_vec(),
        signals.velocity.to_vec(),
        direction,
        size,
        with_direction,
    ]
}
