//! Gauss-Newton on rollouts, with bounds and what is known beforehand.

use dynid_linalg::Mat;

use super::evaluation::{Evaluation, ServoProblem};
use crate::channel::Channel;
use crate::free::{Free, ServoValues};
use crate::log::ServoLog;
use crate::rollout::Lost;

/// How far a fit goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussNewton {
    /// Largest number of simulations. Default 80.
    pub evaluations: usize,
    /// Relative change of the loss that ends a fit. Default 1e-5.
    pub tolerance: f64,
    /// Accepted steps after which the weights of the joints stay at the latest; they follow the residuals until then. Default 12.
    pub reweighted: usize,
}

impl Default for GaussNewton {
    fn default() -> Self {
        GaussNewton { evaluations: 80, tolerance: 1e-5, reweighted: 12 }
    }
}

/// How a fit ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ending {
    /// The loss changed by less than the tolerance.
    Converged,
    /// No step lowers the loss any more, or the last ones lowered it by next to nothing, such as those along a parameter that is hardly seen.
    Stalled,
    /// The largest number of simulations was reached.
    Unfinished,
}

/// Where a free parameter stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// Between its bounds.
    Inside,
    /// At its least value, and the data would have it go on.
    AtLower,
    /// At its greatest value.
    AtUpper,
    /// No reading depends on it.
    Unseen,
}

/// A fit.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// All numbers.
    pub values: ServoValues,
    /// Values of the free parameters.
    pub estimate: Vec<f64>,
    /// Where each of them stands.
    pub places: Vec<Place>,
    /// Rollouts at the estimate.
    pub evaluation: Evaluation,
    /// Accepted steps.
    pub iterations: usize,
    /// Simulations.
    pub evaluations: usize,
    /// How it ended.
    pub ending: Ending,
}

/// Relative rise of the loss that a step may bring. Whether a joint at rest breaks away or not is decided at an instant, and no slope
/// sees it: the loss has jumps of this size where gears stick.
const ROUGH: f64 = 0.01;

/// Last accepted steps that are looked at when the largest number of simulations is reached, and the relative gain of all of them
/// below which the fit counts as done.
const LAST: usize = 5;
const NEXT_TO_NOTHING: f64 = 1e-3;

/// Steps in a row that may raise the loss.
const SIDEWAYS: usize = 4;

/// Relative change of a standard deviation of the weights that does not matter any more.
const SETTLED: f64 = 0.01;

/// First share of the diagonal that is added to the sums (Levenberg 1944, Marquardt 1963).
const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
const MOST_DAMPING: f64 = 1e8;

/// Least standard deviation of every reading: that of the encoder's rounding, else a tiny number.
pub(crate) fn floors(logs: &[ServoLog], channels: &[Channel], joints: usize) -> Vec<f64> {
    let floor = |(channel, j): (Channel, usize)| {
        let of_logs = logs.iter().map(|log| log.floor(j)).fold(0.0_f64, f64::max);
        if channel == Channel::Position { of_logs.max(LEAST_STD) } else { LEAST_STD }
    };
    channels.iter().flat_map(|c| (0..joints).map(move |j| (*c, j))).map(floor).collect()
}

const LEAST_STD: f64 = 1e-9;

/// Fits the free parameters from a start, to a choice of blocks.
///
/// # Errors
/// [`Lost`] if the simulation of the start gets lost.
pub fn fit(
    problem: &ServoProblem<'_>,
    start: &ServoValues,
    settings: &GaussNewton,
    take: &dyn Fn(usize) -> bool,
) -> Result<Fitted, Lost> {
    let free = problem.free;
    let floors = floors(problem.logs, problem.channels, start.joints.len());
    let weights = |e: &Evaluation| -> Vec<f64> {
        e.variances(take).iter().zip(&floors).map(|(s, floor)| s.sqrt().max(*floor)).collect()
    };
    let clip = |values: Vec<f64>| -> Vec<f64> {
        values.iter().zip(free).map(|(x, f)| x.clamp(f.lower, f.upper)).collect()
    };
    let mut estimate = clip(start.gather(free));
    let mut values = start.with(free, &estimate);
    let first = Evaluation::new(problem, &values, &floors, false)?;
    let mut evaluation = Evaluation::new(problem, &values, &weights(&first), true)?;
    let (mut evaluations, mut iterations) = (2, 0);
    let mut damping = FIRST_DAMPING;
    let mut ending = Ending::Unfinished;
    let mut places = vec![Place::Inside; free.len()];
    // Where the loss was lowest before steps that raised it.
    let mut best: Option<(f64, Evaluation, Vec<f64>, ServoValues)> = None;
    let mut sideways = 0;
    let mut gains = Vec::new();
    while evaluations < settings.evaluations {
        let (hessian, gradient) = with_priors(evaluation.normal(take), free, &estimate);
        places = placed(free, &estimate, &hessian, &gradient);
        let moving: Vec<usize> = (0..free.len()).filter(|k| places[*k] == Place::Inside).collect();
        let Some(step) = damped(&hessian, &gradient, &moving, damping) else {
            ending = Ending::Stalled;
            break;
        };
        let mut proposed = estimate.clone();
        for (k, change) in moving.iter().zip(&step) {
            proposed[*k] += change;
        }
        let proposed = clip(proposed);
        let sigma = evaluation.sigma.clone();
        let loss = |e: &Evaluation, x: &[f64]| e.loss(&sigma, take) + prior_loss(free, x);
        let before = loss(&evaluation, &estimate);
        let next = start.with(free, &proposed);
        let wanted = weights(&evaluation);
        let settled = iterations >= settings.reweighted
            || sigma.iter().zip(&wanted).all(|(old, new)| (new / old - 1.0).abs() <= SETTLED);
        let next_sigma = if settled { sigma.clone() } else { wanted };
        evaluations += 1;
        let tried = Evaluation::new(problem, &next, &next_sigma, true);
        let after = tried.as_ref().map_or(f64::INFINITY, |e| loss(e, &proposed));
        let gain = (before - after) / before;
        let small = gain.abs() <= settings.tolerance;
        let Ok(tried) = tried.map_err(|_| ()).and_then(|t| if gain >= -ROUGH { Ok(t) } else { Err(()) })
        else {
            damping *= 8.0;
            if damping > MOST_DAMPING {
                ending = Ending::Stalled;
                break;
            }
            continue;
        };
        if gain < 0.0 && !small {
            sideways += 1;
            if sideways > SIDEWAYS {
                ending = Ending::Stalled;
                break;
            }
            best.get_or_insert((before, evaluation.clone(), estimate.clone(), values.clone()));
            damping *= 2.0;
        } else {
            damping = (damping / 5.0).max(LEAST_DAMPING);
        }
        (evaluation, estimate, values) = (tried, proposed, next);
        iterations += 1;
        gains.push(gain);
        if best
            .as_ref()
            .is_some_and(|b| evaluation.loss(&b.1.sigma, take) + prior_loss(free, &estimate) < b.0)
        {
            (best, sideways) = (None, 0);
        }
        if settled && small {
            ending = Ending::Converged;
            break;
        }
    }
    let last = &gains[gains.len().saturating_sub(LAST)..];
    if ending == Ending::Unfinished && last.len() == LAST && last.iter().sum::<f64>() < NEXT_TO_NOTHING {
        ending = Ending::Stalled;
    }
    if let Some((_, e, x, v)) = best {
        (evaluation, estimate, values) = (e, x, v);
    }
    let (hessian, gradient) = with_priors(evaluation.normal(take), free, &estimate);
    let last = placed(free, &estimate, &hessian, &gradient);
    // A parameter that was held at its bound when the fit ended stands there still, whatever the last gradient says of its rounding.
    for (place, last) in places.iter_mut().zip(last) {
        if *place == Place::Inside || last != Place::Inside {
            *place = last;
        }
    }
    Ok(Fitted { values, estimate, places, evaluation, iterations, evaluations, ending })
}

/// Adds what is known beforehand.
pub(crate) fn with_priors(
    (mut hessian, mut gradient): (Mat, Vec<f64>),
    free: &[Free],
    estimate: &[f64],
) -> (Mat, Vec<f64>) {
    for (k, f) in free.iter().enumerate() {
        if let Some(known) = &f.prior {
            hessian[(k, k)] += known.weight();
            gradient[k] += (known.value - estimate[k]) * known.weight();
        }
    }
    (hessian, gradient)
}

fn prior_loss(free: &[Free], estimate: &[f64]) -> f64 {
    let known = |(f, x): (&Free, &f64)| f.prior.map_or(0.0, |p| (x - p.value).powi(2) * p.weight());
    free.iter().zip(estimate).map(known).sum()
}

fn placed(free: &[Free], estimate: &[f64], hessian: &Mat, gradient: &[f64]) -> Vec<Place> {
    let place = |k: usize| {
        let (f, x) = (&free[k], estimate[k]);
        match () {
            () if hessian[(k, k)] <= 0.0 => Place::Unseen,
            () if x <= f.lower && gradient[k] <= 0.0 => Place::AtLower,
            () if x >= f.upper && gradient[k] >= 0.0 => Place::AtUpper,
            () => Place::Inside,
        }
    };
    (0..free.len()).map(place).collect()
}

/// Solves `(H + λ diag H) δ = g` for a choice of parameters, scaled to a unit diagonal.
pub(crate) fn damped(hessian: &Mat, gradient: &[f64], chosen: &[usize], damping: f64) -> Option<Vec<f64>> {
    let scale: Vec<f64> = chosen.iter().map(|k| 1.0 / hessian[(*k, *k)].sqrt()).collect();
    let entry = |i: usize, j: usize| {
        let scaled = hessian[(chosen[i], chosen[j])] * scale[i] * scale[j];
        if i == j { scaled + damping } else { scaled }
    };
    let factor = Mat::from_fn(chosen.len(), chosen.len(), entry).cholesky()?;
    let rhs: Vec<f64> = chosen.iter().zip(&scale).map(|(k, s)| gradient[*k] * s).collect();
    let step = factor.solve_vector(&rhs);
    Some(step.iter().zip(&scale).map(|(x, s)| x * s).collect())
}
