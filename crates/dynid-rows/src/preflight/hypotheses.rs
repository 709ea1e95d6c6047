//! Hypotheses with an amount: where gravity points, the zeros of joints, the unit of the clock, long delays. Each is looked for where a
//! coarse look says that it is worth it.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

use rayon::prelude::*;

use super::PreflightError;
use super::refine::{Unknown, dot, norm};
use super::rows::{reduce, regressor};
use super::samples::Samples;
use super::trial::Trial;
use super::wiring::{Rewiring, Wiring};
use crate::conditioning::KeptColumns;

/// A hypothesis is worth a closer look if the coarse one leaves at most this share of the misfit.
const WORTH: f64 = 0.7;
/// Least angle of gravity from where it was that is worth a word, rad.
const LEAST_TURN: f64 = 0.035;
/// Standard gravity, m/s², and the relative deviation from it at which its size is in question.
const STANDARD_GRAVITY: f64 = 9.80665;
const OTHER_SIZE: f64 = 0.02;
/// Least zero of a joint that is worth a word, rad.
const LEAST_ZERO: f64 = 0.035;
/// An angle this close to a quarter turn, or a clock this close (relative) to a unit in use, is one.
const AS_A_UNIT: f64 = 0.035;
/// Seconds per unit of clocks in use, and their reciprocals: milliseconds, microseconds, nanoseconds, minutes.
const CLOCKS: [f64; 8] = [1e-3, 1e-6, 1e-9, 1e3, 1e6, 1e9, 60.0, 1.0 / 60.0];
/// Steps of ten to the power of a quarter that clocks are looked at in, to either side.
const CLOCK_STEPS: i32 = 6;
/// Least change of the clock that is looked for in the efforts alone, natural logarithm.
const LEAST_CLOCK: f64 = 0.3;
/// Sample rates that logs have, Hz, and greatest speeds of their joints, rad/s or m/s.
const RATES: [f64; 2] = [0.5, 20_000.0];
const SPEEDS: [f64; 2] = [1e-3, 60.0];
/// Longest delay, s, and as a share of the record.
const LONGEST_DELAY: (f64, f64) = (1.5, 0.125);
/// Delays are looked at in such steps, s.
const DELAY_STEP: f64 = 0.025;
/// Shortest delay that is long, s: the clocks of motion and effort may be so far apart.
const LONG: f64 = 0.03;

/// Hypotheses that are worth a trial from a wiring.
///
/// # Errors
/// [`PreflightError`] if a regressor is not finite.
pub(super) fn of(
    trial: &Trial<'_>,
    samples: &Samples,
    wiring: &Wiring,
) -> Result<Vec<Rewiring>, PreflightError> {
    let as_it_is = trial.refinement(samples).fit(wiring)?;
    let look = Look { trial, samples, wiring, worth: WORTH * as_it_is.misfit, values: as_it_is.x };
    let mut out = look.gravity()?;
    out.extend(look.zeros()?);
    out.extend(look.clock()?);
    out.extend(look.delays()?);
    Ok(out)
}

struct Look<'a> {
    trial: &'a Trial<'a>,
    samples: &'a Samples,
    wiring: &'a Wiring,
    /// Misfit that a hypothesis has to leave at most.
    worth: f64,
    /// Parameters that explain the wiring best.
    values: Vec<f64>,
}

impl Look<'_> {
    /// The wiring with the least misfit, if it is worth it.
    fn best(&self, wirings: Vec<Wiring>) -> Result<Option<Wiring>, PreflightError> {
        let problem = self.trial.refinement(self.samples);
        let misfits = wirings
            .par_iter()
            .map(|w| problem.fit(w).map(|fit| fit.misfit))
            .collect::<Result<Vec<f64>, _>>()?;
        let least = wirings.into_iter().zip(misfits).min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(least.filter(|(_, misfit)| *misfit < self.worth).map(|(wiring, _)| wiring))
    }

    fn refined(&self, start: &Wiring, unknown: Unknown) -> Result<Option<Wiring>, PreflightError> {
        let values = (start == self.wiring).then_some(self.values.as_slice());
        let found = self.trial.refinement(self.samples).refine(start, unknown, self.worth, values)?;
        Ok(found.map(|f| f.wiring))
    }

    /// Gravity along the axes of the base, then wherever it fits best; of the standard size where another one is stated.
    fn gravity(&self) -> Result<Vec<Rewiring>, PreflightError> {
        let stated = self.wiring.gravity.unwrap_or(self.trial.gravity);
        let size = norm(stated);
        if size == 0.0 || self.wiring.gravity.is_some() {
            return Ok(Vec::new());
        }
        let far = |g: &[f64; 3]| dot(*g, stated) < LEAST_TURN.cos() * size * norm(*g);
        let axes: Vec<Wiring> = (0..6)
            .map(|k| std::array::from_fn(|i| if i == k / 2 { size * [-1.0, 1.0][k % 2] } else { 0.0 }))
            .filter(far)
            .map(|g| Wiring { gravity: Some(g), ..self.wiring.clone() })
            .collect();
        let mut starts = vec![Wiring { gravity: Some(stated), ..self.wiring.clone() }];
        starts.extend(self.best(axes)?);
        let mut directions = Vec::new();
        for start in starts {
            let refined = self.refined(&start, Unknown::Gravity)?;
            directions.extend(refined.into_iter().chain([start]).filter_map(|w| w.gravity));
        }
        let mut out: Vec<Rewiring> = directions.into_iter().filter(far).map(Rewiring::Gravity).collect();
        if (size / STANDARD_GRAVITY - 1.0).abs() > OTHER_SIZE {
            out.push(Rewiring::Gravity(stated.map(|x| x * STANDARD_GRAVITY / size)));
        }
        Ok(out)
    }

    /// Zeros of joints that turn, from none and from eighths of a turn.
    fn zeros(&self) -> Result<Vec<Rewiring>, PreflightError> {
        let moves = |j: &usize| self.samples.joints[self.wiring.position[*j].joint].moves;
        let turning: Vec<usize> =
            (0..self.samples.joints.len()).filter(|j| !self.trial.slides[*j]).filter(moves).collect();
        let of_joint = |j: usize| -> Result<Vec<Rewiring>, PreflightError> {
            let at = |angle: f64| self.wiring.with(&Rewiring::Zero(j, angle), self.trial.slides);
            let eighths = (1..8).map(|k| at(f64::from(k) * FRAC_PI_4)).collect();
            let mut starts = vec![self.wiring.clone()];
            starts.extend(self.best(eighths)?);
            let mut out = Vec::new();
            for start in starts {
                let refined = self.refined(&start, Unknown::Zero(j))?;
                let by = |w: &Wiring| wrapped(w.position[j].offset - self.wiring.position[j].offset);
                let angles = refined.iter().chain([&start]).map(by).filter(|a| a.abs() > LEAST_ZERO);
                out.extend(angles.map(|a| Rewiring::Zero(j, as_a_quarter(a))));
            }
            Ok(out)
        };
        let each = turning.into_par_iter().map(of_joint).collect::<Result<Vec<_>, _>>()?;
        Ok(each.concat())
    }

    /// The clock that measured velocities show; without them, one under which the efforts belong to the robot.
    fn clock(&self) -> Result<Vec<Rewiring>, PreflightError> {
        if self.wiring.clock != 1.0 {
            return Ok(Vec::new());
        }
        let by = |factor: f64| self.wiring.with(&Rewiring::Clock(factor), self.trial.slides);
        if let Some(shown) = self.trial.clock {
            let other = shown.ln().abs() > LEAST_CLOCK;
            return Ok(other.then(|| Rewiring::Clock(as_a_clock(shown))).into_iter().collect());
        }
        let steps = (-CLOCK_STEPS..=CLOCK_STEPS).filter(|k| *k != 0);
        let factors = CLOCKS.into_iter().chain(steps.map(|k| 10f64.powf(0.25 * f64::from(k))));
        let factors = factors.filter(|factor| self.is_a_clock(*factor));
        let Some(best) = self.best(factors.map(by).collect())? else { return Ok(Vec::new()) };
        let refined = self.refined(&best, Unknown::Clock)?;
        let found = refined.iter().chain([&best]).map(|w| as_a_clock(w.clock));
        let other = |c: &f64| c.ln().abs() > LEAST_CLOCK && self.is_a_clock(*c);
        Ok(found.filter(other).map(Rewiring::Clock).collect())
    }

    /// Whether rate and speeds that are possible as logged are so under another clock. Much faster clocks sever inertia from gravity, and so
    /// free bodies of what they owe each other: whatever is missing in the model is then explained better.
    fn is_a_clock(&self, factor: f64) -> bool {
        let joints = self.wiring.position.iter().map(|source| {
            let velocity = &self.samples.joints[source.joint].velocity;
            velocity.iter().fold(0.0_f64, |most, v| most.max((source.factor * v).abs()))
        });
        let fastest = joints.fold(0.0, f64::max);
        [(self.samples.rate_hz, RATES), (fastest, SPEEDS)].into_iter().all(|(as_logged, [low, high])| {
            let within = |x: f64| (low..=high).contains(&x);
            within(as_logged / factor) || !within(as_logged)
        })
    }

    /// Delays at which the efforts fit the motion far better than at none: local minima of what linear parameters leave.
    fn delays(&self) -> Result<Vec<Rewiring>, PreflightError> {
        let Look { trial, samples, wiring, .. } = self;
        if wiring.delay_s != trial.delay_s {
            return Ok(Vec::new());
        }
        let rate = samples.rate_hz;
        let farthest = LONGEST_DELAY.0.min(LONGEST_DELAY.1 * samples.duration_s);
        let step = (DELAY_STEP * rate).round().max(1.0);
        let steps = (farthest * rate / step).floor();
        if steps < 1.0 {
            return Ok(Vec::new());
        }
        let lags: Vec<f64> = (0..=2 * steps as usize).map(|k| step * (k as f64 - steps)).collect();
        // Beyond the ends of the record nothing is known of the efforts.
        let reach = (step * steps) as usize;
        let mut inner = (*samples).clone();
        let ends = trial.log.samples().saturating_sub(reach);
        let known: Vec<bool> = inner.kept.iter().map(|k| (reach..ends).contains(k)).collect();
        for joint in &mut inner.joints {
            joint.sliding.iter_mut().zip(&known).for_each(|(sliding, known)| *sliding &= known);
        }
        let columns = KeptColumns::new(trial.model, trial.kept);
        let block = regressor(trial.model, trial.shape, samples, wiring);
        let of_output = |output: usize| -> Result<Vec<f64>, PreflightError> {
            let effort = trial.whole_effort(wiring.effort[output].joint, trial.delay_s)?;
            let last = effort.len() as f64 - 1.0;
            let at = |lag: &f64| -> Vec<f64> {
                samples.kept.iter().map(|k| effort[(*k as f64 - lag).clamp(0.0, last) as usize]).collect()
            };
            let moved: Vec<Vec<f64>> = lags.iter().map(at).collect();
            let beside: Vec<&[f64]> = moved.iter().map(Vec::as_slice).collect();
            let parts = reduce(&block, &columns, &inner, &wiring.position, output, &beside, 1)?;
            let own = columns.local[output].len();
            let left = |lag: usize| {
                let (column, part) = (own + lag, &parts[0]);
                let height = part.height().min(column + 1);
                let power = |from: usize| (from..height).map(|i| part.r(i, column).powi(2)).sum::<f64>();
                power(own.min(height)) / power(0).max(f64::MIN_POSITIVE)
            };
            Ok((0..lags.len()).map(left).collect())
        };
        let each = (0..samples.joints.len()).into_par_iter().map(of_output).collect::<Result<Vec<_>, _>>()?;
        let left: Vec<f64> = (0..lags.len()).map(|k| each.iter().map(|e| e[k]).sum()).collect();
        let none = left[steps as usize];
        let mut minima: Vec<usize> = (1..lags.len() - 1)
            .filter(|k| left[*k] < left[k - 1] && left[*k] <= left[k + 1] && left[*k] < WORTH * none)
            .collect();
        minima.sort_by(|a, b| left[*a].total_cmp(&left[*b]));
        let between = |k: &usize| {
            let (before, at, after) = (left[k - 1], left[*k], left[k + 1]);
            let bend = before - 2.0 * at + after;
            let shift = if bend > 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
            (lags[*k] + step * shift) / rate
        };
        Ok(minima.iter().take(2).map(between).filter(|d| d.abs() > LONG).map(Rewiring::Delay).collect())
    }
}

/// Between minus and plus half a turn.
fn wrapped(angle: f64) -> f64 {
    let turned = (angle + PI).rem_euclid(2.0 * PI) - PI;
    if turned == -PI { PI } else { turned }
}

fn as_a_quarter(angle: f64) -> f64 {
    let quarter = (angle / FRAC_PI_2).round() * FRAC_PI_2;
    if quarter != 0.0 && (angle - quarter).abs() < AS_A_UNIT { quarter } else { angle }
}

fn as_a_clock(factor: f64) -> f64 {
    CLOCKS.into_iter().find(|c| (factor / c - 1.0).abs() < AS_A_UNIT).unwrap_or(factor)
}
