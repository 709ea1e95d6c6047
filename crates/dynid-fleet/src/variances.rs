//! Spread of parameters between robots and between logs of a robot: restricted maximum likelihood by EM.
//!
//! Source: Laird and Ware 1982 (EM), Varadhan and Roland 2008 (acceleration), Lange, Little and Taylor 1989 (Student's t).

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::data::{Fleet, FleetError};
use crate::split::Splits;
use crate::spread::{LEFT_OUT, Variances};
use crate::sweep::Sweep;

/// Student's t takes a coordinate of a robot or log for at least this.
const LEAST_WEIGHT: f64 = 2.0 * LEFT_OUT;
/// Degrees of freedom of the prior of a variance that few robots or logs tell.
const PRIOR_FREEDOM: f64 = 4.0;
/// Largest change of the logarithm of a variance by one extrapolation.
const LONGEST: f64 = 3.0;
/// A variance below this share of the smallest estimation variance is no spread.
const NO_SPREAD: f64 = 1e-4;

/// How variances are found.
#[derive(Debug, Clone, PartialEq)]
pub struct VarianceSettings {
    /// Degrees of freedom of Student's t, coordinate by coordinate; `None`: normal deviations, weights as they are.
    pub freedom: Option<f64>,
    /// Largest change of the logarithm of a variance at the end; of one below the smallest estimation variance times its share of that.
    pub tolerance: f64,
    /// Most sweeps of the fleet.
    pub passes: usize,
    /// A variance that fewer robots or logs tell leans on its start and on the other coordinates of its kind.
    pub few: usize,
    /// Whether steps are extrapolated.
    pub accelerated: bool,
}

impl Default for VarianceSettings {
    fn default() -> Self {
        VarianceSettings {
            freedom: None,
            tolerance: 5e-3,
            passes: 100,
            few: crate::data::FEW,
            accelerated: true,
        }
    }
}

/// Whether variances settled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settled {
    /// Sweeps of the fleet.
    pub passes: usize,
    /// Largest change of the logarithm of a variance in the last one.
    pub change: f64,
    /// Whether that is below the tolerance.
    pub converged: bool,
}

/// Second moments of a robot, and of its logs by their indices.
type OfRobot = (Vec<f64>, Vec<(usize, Vec<f64>)>);

/// Second moments of the deviations of single robots and logs; empty for a robot without logs.
pub(crate) struct Moments {
    pub(crate) robots: Vec<Vec<f64>>,
    pub(crate) logs: Vec<Vec<f64>>,
}

impl Moments {
    pub(crate) fn of(sweep: &Sweep<'_>) -> Moments {
        let splits = sweep.splits;
        let q = splits.q;
        let of = |r: usize| {
            let of_robot = &splits.by_robot[r];
            if of_robot.is_empty() {
                return (Vec::new(), Vec::new());
            }
            let state = sweep.robot(r);
            let second =
                |d: &crate::sweep::Deviation| (0..q).map(|k| d.mean[k].powi(2) + d.variance(k)).collect();
            let logs: Vec<(usize, Vec<f64>)> =
                of_robot.iter().map(|k| (*k, second(&sweep.log(*k, &state)))).collect();
            (second(&state.deviation), logs)
        };
        let found: Vec<OfRobot> = (0..splits.by_robot.len()).into_par_iter().map(of).collect();
        let mut logs = vec![Vec::new(); splits.logs.len()];
        let mut robots = Vec::new();
        for (robot, own) in found {
            robots.push(robot);
            own.into_iter().for_each(|(k, moments)| logs[k] = moments);
        }
        Moments { robots, logs }
    }
}

/// One step of EM.
struct Maximisation<'a> {
    fleet: &'a Fleet,
    splits: &'a Splits,
    settings: &'a VarianceSettings,
    /// Variances at the start, the scale of coordinates.
    start: &'a Variances,
}

impl Maximisation<'_> {
    /// Renews weights (with Student's t) and variances.
    fn step(&self, now: &Variances, moments: &Moments) -> Variances {
        let mut next = now.clone();
        if let Some(freedom) = self.settings.freedom {
            renew(&mut next.robot_weights, &moments.robots, &now.robots, freedom);
            renew(&mut next.log_weights, &moments.logs, &now.logs, freedom);
        }
        let robots = self
            .splits
            .robots
            .iter()
            .map(|(_, r)| (moments.robots[*r].as_slice(), next.robot_weights[*r].as_slice()));
        next.robots = self.level(&now.robots, &self.start.robots, robots);
        let logs = self
            .splits
            .ordered
            .iter()
            .map(|k| (moments.logs[*k].as_slice(), next.log_weights[*k].as_slice()));
        next.logs = self.level(&now.logs, &self.start.logs, logs);
        next
    }

    /// Variances of one level from moments and weights of its units, in an order that is the fleet's own.
    fn level<'a>(
        &self,
        now: &[f64],
        start: &[f64],
        units: impl Iterator<Item = (&'a [f64], &'a [f64])>,
    ) -> Vec<f64> {
        let mut sums = vec![(0.0, 0.0); now.len()];
        for (moments, weights) in units {
            let of_unit = sums.iter_mut().zip(moments).zip(weights).zip(start.iter().zip(now));
            for (((sum, moment), weight), (start, now)) in of_unit {
                if *weight > LEFT_OUT && *now > 0.0 {
                    *sum = (sum.0 + weight * moment / start, sum.1 + 1.0);
                }
            }
        }
        let varying = &self.fleet.varying;
        let few = self.settings.few as f64;
        let variance = |k: usize| {
            let (mut total, mut count) = sums[k];
            if count < few {
                let alike = |i: &usize| varying[*i].kind == varying[k].kind;
                let pooled = (0..now.len()).filter(alike).map(|i| sums[i]);
                (total, count) = pooled.fold((0.0, 0.0), |(t, c), (sum, n)| (t + sum, c + n));
            }
            if count < few {
                (total, count) = (total + PRIOR_FREEDOM, count + PRIOR_FREEDOM);
            }
            start[k] * total / count
        };
        (0..now.len()).map(|k| if now[k] > 0.0 { variance(k) } else { 0.0 }).collect()
    }
}

/// `ω = (ν + 1)/(ν + E[b²]/D)`; what is left out stays so.
fn renew(weights: &mut [Vec<f64>], moments: &[Vec<f64>], variances: &[f64], freedom: f64) {
    for (own, moments) in weights.iter_mut().zip(moments) {
        for ((weight, moment), variance) in own.iter_mut().zip(moments).zip(variances) {
            if *variance > 0.0 && *weight > LEFT_OUT {
                *weight = ((freedom + 1.0) / (freedom + moment / variance)).max(LEAST_WEIGHT);
            }
        }
    }
}

/// Variances that maximise the restricted likelihood from where they are; those that are 0 stay so.
///
/// # Errors
/// As [`Sweep::new`].
pub(crate) fn maximise(
    fleet: &Fleet,
    splits: &Splits,
    (start, from): (&Variances, Variances),
    settings: &VarianceSettings,
    prior: Option<&Mat>,
) -> Result<(Variances, Settled), FleetError> {
    let step = Maximisation { fleet, splits, settings, start };
    let mut now = from;
    let mut passes = 0;
    let mut change = f64::INFINITY;
    // The last points of a run of plain steps, and the likelihood of the one before the last.
    let mut run: Vec<Variances> = Vec::new();
    let mut guard: Option<(f64, Variances)> = None;
    while passes < settings.passes && change > settings.tolerance {
        let sweep = Sweep::new(splits, &now, prior)?;
        passes += 1;
        if let Some((m2l, before)) = guard.take()
            && settings.freedom.is_none()
            && sweep.m2l > m2l
        {
            // The extrapolation went too far.
            now = before;
            continue;
        }
        let mut next = step.step(&now, &Moments::of(&sweep));
        let (m2l, (robots, logs)) = (sweep.m2l, sweep.information());
        none_where_unseen(&mut next.robots, &robots);
        none_where_unseen(&mut next.logs, &logs);
        change = largest_change((&now.robots, &next.robots), &robots)
            .max(largest_change((&now.logs, &next.logs), &logs));
        run.push(now);
        if settings.accelerated && run.len() == 2 && change > settings.tolerance {
            let far = extrapolated(&run[0], &run[1], &next);
            guard = Some((m2l, next));
            run.clear();
            now = far;
        } else {
            if run.len() == 2 {
                run.clear();
            }
            now = next;
        }
    }
    Ok((now, Settled { passes, change, converged: change <= settings.tolerance }))
}

fn none_where_unseen(variances: &mut [f64], information: &[f64]) {
    for (variance, information) in variances.iter_mut().zip(information) {
        if *variance * information < NO_SPREAD {
            *variance = 0.0;
        }
    }
}

/// Largest change of the logarithm of a variance, each as far as it decides something: one that is small beside all estimation variances goes to zero
/// without end, and changes no deviation on its way.
fn largest_change((before, after): (&[f64], &[f64]), information: &[f64]) -> f64 {
    let change = |((a, b), information): ((&f64, &f64), &f64)| match *a > 0.0 && *b > 0.0 {
        true => (b / a).ln().abs() * (a.max(*b) * information).min(1.0),
        false => 0.0,
    };
    before.iter().zip(after).zip(information).map(change).fold(0.0, f64::max)
}

/// One step of squared extrapolation in the logarithms, with the weights of the last point.
fn extrapolated(first: &Variances, second: &Variances, third: &Variances) -> Variances {
    let (a, b, c) = (first.joined(), second.joined(), third.joined());
    let lives: Vec<bool> = (0..a.len()).map(|k| a[k] > 0.0 && b[k] > 0.0 && c[k] > 0.0).collect();
    let difference = |x: &[f64], y: &[f64], k: usize| if lives[k] { (y[k] / x[k]).ln() } else { 0.0 };
    let r: Vec<f64> = (0..a.len()).map(|k| difference(&a, &b, k)).collect();
    let v: Vec<f64> = (0..a.len()).map(|k| difference(&b, &c, k) - r[k]).collect();
    let (long, bent) =
        (crate::triangle::squares(r.iter().copied()), crate::triangle::squares(v.iter().copied()));
    let alpha = if bent > 0.0 { (-(long / bent).sqrt()).clamp(-8.0, -1.0) } else { -1.0 };
    let far = |k: usize| {
        let moved = (-2.0 * alpha * r[k] + alpha * alpha * v[k]).clamp(-LONGEST, LONGEST);
        if lives[k] { a[k] * moved.exp() } else { c[k] }
    };
    third.with(&(0..a.len()).map(far).collect::<Vec<_>>())
}
