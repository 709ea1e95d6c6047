//! Linear start: the control error regressed on filtered motion.
//!
//! With `F` a zero-phase low pass on every column, rigid effort `T = M a + b` of the known bodies and `g = 1/k_p`,
//!
//! ```text
//! F e = g T + g (k_d + F_v) v + g I_a a + g F_c s_F + g o,    e = u(t - d) - x,   s_F = F sign(v)
//! ```
//!
//! The control error stands on the left and the sign is filtered like the rest. With the effort on the left the scale hangs on `T`
//! alone; where light links make it a small part of `k_p e` the zero vector nearly solves the equation, and the smeared kink of
//! Coulomb friction shrinks all coefficients together. Here its error reaches `g` alone, and ratios stay right. The rotor inertia stays
//! uncertain by up to a quarter: a lag of the delay is much like it below 5 Hz.

use dynid_linalg::Mat;
use dynid_motion::difference::central;
use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::signal::{SignalError, rms};

use crate::chain::{Chain, Equation};
use crate::free::{Free, ServoValues};
use crate::joint::{Hold, Scheme};
use crate::log::{Command, ServoLog};
use crate::term::Term;

/// Filters and the grid of delays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StartSettings {
    /// Cut-off of all columns, Hz; at most 0.3 of the sample rate. Default 15.
    pub cutoff_hz: f64,
    /// Cut-off of the velocity whose sign is taken, Hz; at most 0.4 of the sample rate. Default 40.
    pub sign_cutoff_hz: f64,
    /// Width of that sign, rad/s. Default 0.02.
    pub sign_width: f64,
    /// Largest delay that is tried, s. Default 0.06.
    pub longest_delay: f64,
    /// Distance of delays that are tried, s. Default 0.002.
    pub delay_step: f64,
}

impl Default for StartSettings {
    fn default() -> Self {
        StartSettings {
            cutoff_hz: 15.0,
            sign_cutoff_hz: 40.0,
            sign_width: 0.02,
            longest_delay: 0.06,
            delay_step: 0.002,
        }
    }
}

/// What the linear start found.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearStart {
    /// All numbers: those that are free as found, clipped to their bounds, others as given.
    pub values: ServoValues,
    /// Relative residual of every joint: rms of what the columns do not explain over rms of the left side.
    pub residual: Vec<f64>,
}

/// Order of the low passes.
const ORDER: usize = 2;

/// Part of a record at either end that filters spoil, in periods of the cut-off.
const EDGE: f64 = 2.0;

/// Terms that are columns; every other keeps the value that it has.
const COLUMNS: [Term; 4] = [Term::Viscous, Term::RotorInertia, Term::Coulomb, Term::Offset];

/// Signals of one joint over all logs, filtered and cut.
struct Signals {
    /// Known bodies' effort.
    rigid: Vec<f64>,
    /// Columns in the order of [`COLUMNS`].
    columns: [Vec<f64>; 4],
    /// Per log: what the control error needs.
    logs: Vec<LogSignals>,
}

struct LogSignals {
    command: Command,
    time: Vec<f64>,
    period: f64,
    position: Vec<f64>,
    cutoff_hz: f64,
    keep: std::ops::Range<usize>,
}

/// Finds a start for output error.
///
/// `values`: what is known, with zeros and directions; `free`: what is asked for. Position gains, delays and the columns of
/// friction, rotor inertia and offset are found; all else stays as given.
///
/// # Errors
/// [`SignalError`] of a log that is too short or not finite.
pub fn linear_start(
    chains: &[Chain],
    logs: &[ServoLog],
    values: &ServoValues,
    free: &[Free],
    scheme: Scheme,
    settings: &StartSettings,
) -> Result<LinearStart, SignalError> {
    let signals = signals(chains, logs, values, scheme, settings)?;
    let n = values.joints.len();
    let groups = |term: Term| -> Vec<Vec<usize>> {
        let mut of: Vec<Vec<usize>> =
            free.iter().filter(|f| f.as_term() == Some(term)).map(|f| f.joints().to_vec()).collect();
        let alone: Vec<usize> = (0..n).filter(|j| !of.iter().flatten().any(|k| k == j)).collect();
        of.extend(alone.into_iter().map(|j| vec![j]));
        of
    };
    let is_free =
        |term: Term, j: usize| free.iter().any(|f| f.as_term() == Some(term) && f.joints().contains(&j));
    let gains = groups(Term::PositionGain);
    let mut delays: Vec<f64> = values.joints.iter().map(|j| j.get(Term::Delay)).collect();
    let delay_groups: Vec<Vec<usize>> =
        groups(Term::Delay).into_iter().filter(|g| is_free(Term::Delay, g[0])).collect();
    let mut solver = LinearSolver { signals: &signals, values, errors: vec![Vec::new(); n] };
    let tried = (settings.longest_delay / settings.delay_step).round() as usize + 1;
    // Delays of joints that share a gain are found in turn.
    let rounds = if delay_groups.len() > 1 && gains.iter().any(|g| g.len() > 1) { 2 } else { 1 };
    for _ in 0..rounds {
        for group in &delay_groups {
            let near: Vec<&Vec<usize>> =
                gains.iter().filter(|g| g.iter().any(|j| group.contains(j))).collect();
            let mut losses = Vec::with_capacity(tried);
            for k in 0..tried {
                let delay = k as f64 * settings.delay_step;
                group.iter().for_each(|j| delays[*j] = delay);
                let mut loss = 0.0;
                for gain in &near {
                    loss += solver.solve(gain, &delays, &is_free)?.loss;
                }
                losses.push(loss);
            }
            let delay = lowest(&losses, settings.delay_step);
            group.iter().for_each(|j| delays[*j] = delay);
        }
    }
    let mut out = values.clone();
    let mut residual = vec![0.0; n];
    for gain in &gains {
        let solution = solver.solve(gain, &delays, &is_free)?;
        for (j, found) in gain.iter().zip(&solution.joints) {
            residual[*j] = found.residual;
            for (term, value) in &found.values {
                out.joints[*j].set(*term, *value);
            }
            out.joints[*j].set(Term::Delay, delays[*j]);
        }
    }
    let shared = out.clone();
    for f in free {
        // A shared column is the mean of its joints' own.
        let own: Vec<f64> =
            f.joints().iter().filter_map(|j| f.as_term().map(|t| shared.joints[*j].get(t))).collect();
        if !own.is_empty() {
            let mean = own.iter().sum::<f64>() / own.len() as f64;
            out.set(f, mean.clamp(f.lower, f.upper));
        }
    }
    Ok(LinearStart { values: out, residual })
}

/// Place of the lowest value of a grid that begins at zero, by a parabola through its neighbours.
fn lowest(losses: &[f64], step: f64) -> f64 {
    let best = (0..losses.len()).min_by(|a, b| losses[*a].total_cmp(&losses[*b])).unwrap_or(0);
    if best == 0 || best + 1 >= losses.len() {
        return best as f64 * step;
    }
    let (a, b, c) = (losses[best - 1], losses[best], losses[best + 1]);
    let bend = a - 2.0 * b + c;
    let shift = if bend > 0.0 { 0.5 * (a - c) / bend } else { 0.0 };
    (best as f64 + shift) * step
}

fn signals(
    chains: &[Chain],
    logs: &[ServoLog],
    values: &ServoValues,
    scheme: Scheme,
    settings: &StartSettings,
) -> Result<Vec<Signals>, SignalError> {
    let empty = || Signals { rigid: Vec::new(), columns: Default::default(), logs: Vec::new() };
    let mut out: Vec<Signals> = values.joints.iter().map(|_| empty()).collect();
    for log in logs {
        let period = log.period();
        let rate = 1.0 / period;
        let cutoff_hz = settings.cutoff_hz.min(0.3 * rate);
        let low = butterworth(ORDER, cutoff_hz, rate)?;
        let high = butterworth(ORDER, settings.sign_cutoff_hz.min(0.4 * rate), rate)?;
        let rows = ((log.time[log.rows() - 1] - log.time[0]) * rate).floor() as usize + 1;
        let time: Vec<f64> = (0..rows).map(|k| log.time[0] + k as f64 * period).collect();
        let edge = ((EDGE * rate / cutoff_hz).ceil() as usize).min(rows / 4);
        let keep = edge..rows - edge;
        for chain in chains {
            let mut motion = Vec::with_capacity(chain.len());
            for j in &chain.joints {
                let joint = &values.joints[*j];
                let reading = resampled(&log.time, &log.position[*j], &time);
                let position: Vec<f64> = reading.iter().map(|x| joint.position(*x)).collect();
                let q = forward_backward(&low, &position)?;
                let v = central(&q, rate)?;
                let a = central(&v, rate)?;
                let fast = central(&forward_backward(&high, &position)?, rate)?;
                let sign: Vec<f64> = fast.iter().map(|v| (v / settings.sign_width).tanh()).collect();
                motion.push((position, q, v, a, forward_backward(&low, &sign)?));
            }
            let mut equation = Equation::new(chain, &values.inertias);
            let n = chain.len();
            let mut effort = vec![0.0; n];
            for row in keep.clone() {
                let of = |pick: fn(&Motion) -> &Vec<f64>| {
                    motion.iter().map(|m| pick(m)[row]).collect::<Vec<f64>>()
                };
                equation.efforts(&of(|m| &m.1), &of(|m| &m.2), &of(|m| &m.3), &mut effort);
                chain.joints.iter().zip(&effort).for_each(|(j, e)| out[*j].rigid.push(*e));
            }
            for (j, (position, _, v, a, sign)) in chain.joints.iter().zip(motion) {
                let ones = vec![1.0; rows];
                for (to, from) in out[*j].columns.iter_mut().zip([&v, &a, &sign, &ones]) {
                    to.extend_from_slice(&from[keep.clone()]);
                }
                let joint = &values.joints[*j];
                let command: Vec<f64> =
                    log.command[*j].iter().map(|u| joint.position(joint.taken(*u))).collect();
                out[*j].logs.push(LogSignals {
                    command: Command::new(&log.time, &command, scheme.hold),
                    time: time.clone(),
                    // A held command is the line through its values half a period later: its mean over a period.
                    period: if scheme.hold == Hold::Held { period } else { 1e-6 * period },
                    position,
                    cutoff_hz,
                    keep: keep.clone(),
                });
            }
        }
    }
    Ok(out)
}

type Motion = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>);

/// Values on another clock, by lines.
fn resampled(time: &[f64], values: &[f64], at: &[f64]) -> Vec<f64> {
    let mut k = 0;
    let mut one = |t: f64| {
        while k + 2 < time.len() && time[k + 1] <= t {
            k += 1;
        }
        let share = ((t - time[k]) / (time[k + 1] - time[k])).clamp(0.0, 1.0);
        values[k] + share * (values[k + 1] - values[k])
    };
    at.iter().map(|t| one(*t)).collect()
}

struct LinearSolver<'a> {
    signals: &'a [Signals],
    values: &'a ServoValues,
    /// Per joint: delays with their filtered control errors.
    errors: Vec<Vec<(f64, Vec<f64>)>>,
}

struct Solution {
    joints: Vec<JointSolution>,
    /// Squared relative residuals of the joints together.
    loss: f64,
}

struct JointSolution {
    values: Vec<(Term, f64)>,
    residual: f64,
}

/// Least share of the position gain of one joint's rigid bodies at 5 Hz that stands in for a gain which the data give the wrong sign.
const FALLBACK_HZ: f64 = 5.0;

impl LinearSolver<'_> {
    /// Filtered control error of a joint at a delay.
    fn error(&mut self, j: usize, delay: f64) -> Result<Vec<f64>, SignalError> {
        if let Some((_, known)) = self.errors[j].iter().find(|(d, _)| *d == delay) {
            return Ok(known.clone());
        }
        let mut out = Vec::new();
        for log in &self.signals[j].logs {
            let mut at = 0;
            let pairs = log.time.iter().zip(&log.position);
            let error: Vec<f64> = pairs
                .map(|(t, q)| log.command.mean(t - 0.5 * log.period, log.period, delay, &mut at).0 - q)
                .collect();
            let rate = 1.0 / (log.time[1] - log.time[0]);
            let low = butterworth(ORDER, log.cutoff_hz, rate)?;
            out.extend_from_slice(&forward_backward(&low, &error)?[log.keep.clone()]);
        }
        self.errors[j].push((delay, out.clone()));
        Ok(out)
    }

    /// Regresses the joints that share a position gain.
    fn solve(
        &mut self,
        group: &[usize],
        delays: &[f64],
        is_free: &dyn Fn(Term, usize) -> bool,
    ) -> Result<Solution, SignalError> {
        let gain_free = is_free(Term::PositionGain, group[0]);
        let mut parts = Vec::new();
        for j in group {
            let error = self.error(*j, delays[*j])?;
            let (joint, signals) = (&self.values.joints[*j], &self.signals[*j]);
            // What is known beside the bodies: the velocity gain, and columns that are not free.
            let mut known = signals.rigid.clone();
            let mut add = |factor: f64, column: &[f64]| {
                known.iter_mut().zip(column).for_each(|(k, c)| *k += factor * c);
            };
            add(joint.get(Term::VelocityGain), &signals.columns[0]);
            let mut columns = Vec::new();
            for (term, column) in COLUMNS.iter().zip(&signals.columns) {
                if is_free(*term, *j) {
                    columns.push((*term, column));
                } else {
                    add(joint.get(*term), column);
                }
            }
            let kp = joint.get(Term::PositionGain);
            let left: Vec<f64> =
                if gain_free { error } else { error.iter().zip(&known).map(|(e, k)| kp * e - k).collect() };
            let weight = 1.0 / rms(&left).max(f64::MIN_POSITIVE);
            parts.push((*j, left, known, columns, weight));
        }
        let rows: usize = parts.iter().map(|(_, left, ..)| left.len()).sum();
        let own: usize = parts.iter().map(|(.., columns, _)| columns.len()).sum();
        let shared = usize::from(gain_free);
        let mut matrix = Mat::zeros(rows, shared + own);
        let mut rhs = vec![0.0; rows];
        let (mut row, mut column) = (0, shared);
        for (_, left, known, columns, weight) in &parts {
            for (to, from) in rhs[row..].iter_mut().zip(left) {
                *to = weight * from;
            }
            let mut put = |c: usize, from: &[f64]| {
                matrix.col_mut(c)[row..].iter_mut().zip(from).for_each(|(t, f)| *t = weight * f);
            };
            if gain_free {
                put(0, known);
            }
            for (k, (_, from)) in columns.iter().enumerate() {
                put(column + k, from);
            }
            row += left.len();
            column += columns.len();
        }
        let x = least_squares(&matrix, &rhs);
        let fitted = matrix.times(&x);
        let gain = if gain_free { x[0] } else { 1.0 };
        let mut out = Solution { joints: Vec::new(), loss: 0.0 };
        let (mut row, mut column) = (0, shared);
        for (j, left, _, columns, _) in &parts {
            let range = row..row + left.len();
            let misses = rhs[range.clone()].iter().zip(&fitted[range]).map(|(a, b)| (a - b) * (a - b));
            let square = misses.sum::<f64>() / left.len() as f64;
            let scale = if gain > 0.0 { 1.0 / gain } else { self.fallback(*j) };
            let mut values: Vec<(Term, f64)> = columns
                .iter()
                .enumerate()
                .map(|(k, (term, _))| (*term, x[column + k] * if gain_free { scale } else { 1.0 }))
                .collect();
            if gain_free {
                values.push((Term::PositionGain, scale));
            }
            out.loss += square;
            out.joints.push(JointSolution { values, residual: square.sqrt() });
            row += left.len();
            column += columns.len();
        }
        Ok(out)
    }

    /// Position gain that would give the joint's own rigid effort at 5 Hz.
    fn fallback(&self, j: usize) -> f64 {
        let known = self.values.joints[j].get(Term::PositionGain);
        if known > 0.0 {
            return known;
        }
        let signals = &self.signals[j];
        let omega = std::f64::consts::TAU * FALLBACK_HZ;
        let inertia = rms(&signals.rigid) / rms(&signals.columns[1]).max(f64::MIN_POSITIVE);
        (inertia * omega * omega).clamp(1e-3, 1e6)
    }
}

/// Least squares with columns of unit length; columns without any entry stay at zero.
fn least_squares(matrix: &Mat, rhs: &[f64]) -> Vec<f64> {
    let norms: Vec<f64> = (0..matrix.ncols()).map(|c| matrix.col_norm(c)).collect();
    let chosen: Vec<usize> = (0..norms.len()).filter(|c| norms[*c] > 0.0).collect();
    let scaled = Mat::from_fn(matrix.nrows(), chosen.len(), |r, c| matrix[(r, chosen[c])] / norms[chosen[c]]);
    let x = scaled.qr().solve_least_squares(&Mat::column(rhs));
    let mut out = vec![0.0; norms.len()];
    for (k, c) in chosen.iter().enumerate() {
        out[*c] = x[(k, 0)] / norms[*c];
    }
    out
}
