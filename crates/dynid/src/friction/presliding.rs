//! Bristles from pre-sliding motion, by simulation error.

use std::ops::ControlFlow;

use dynid_friction::steady_friction::FrictionLaw;
use dynid_motion::signal::quantum;
use dynid_search::{Algorithm, Bounds, PointObjective, SearchError, Settings, covariance_of_values, run};
use dynid_sim::presliding::{EffortHold, PreslidingJoint, SteadyTable, presliding};

use super::config::{FrictionConfig, HoldName, PreslidingLog};
use super::experiment::{on_grid, temperature};
use crate::Error;
use crate::estimate::{InputKind, InputRecord};
use crate::friction_model::FrictionError;
use crate::log::Log;

/// Positions coarser than this share of the motion do not show its shape.
const COARSE: f64 = 0.02;
/// Relative standard deviation from which a value says nothing.
const UNKNOWN: f64 = 0.25;
/// Either side of a guess that the search covers, as a factor.
const REACH: f64 = 40.0;
/// End of the table of steady friction, rad/s or m/s: beyond what a search may come across.
const LARGEST_SPEED: f64 = 100.0;
/// Points per coordinate of the first look.
const GRID: usize = 7;

/// What a pre-sliding log says.
#[derive(Debug, Clone, PartialEq)]
pub struct PreslidingFit {
    /// Log file.
    pub log: String,
    /// Joint.
    pub joint: String,
    /// `σ0, σ1` with standard deviations, or why they are not identifiable.
    pub outcome: Result<[(f64, f64); 2], String>,
    /// Peak to peak of the motion, rad or m.
    pub motion: f64,
    /// Resolution of the positions, rad or m.
    pub resolution: f64,
    /// Residual of the positions at the best point, rad or m.
    pub residual_rms: Option<f64>,
    /// How the effort runs between samples, as fits better or asked for.
    pub hold: Option<EffortHold>,
    /// Time, s, measured and simulated positions, for pictures.
    pub curves: Vec<[f64; 3]>,
    /// Simulations run.
    pub simulations: u64,
}

/// A joint that an effort moves within its friction.
#[derive(Debug, Clone, Copy)]
pub struct PreslidingTest<'a> {
    /// Name of the log.
    pub log: &'a str,
    /// Joint.
    pub joint: &'a str,
    /// Inertia at the joint in this pose, all that moves with it, kg m² or kg.
    pub inertia: f64,
    /// Constant effort in this pose (gravity, offset), N m or N.
    pub offset: f64,
    /// The effort between its samples.
    pub effort_hold: HoldName,
    /// Effort, N m or N.
    pub effort: &'a [f64],
    /// Position, rad or m.
    pub position: &'a [f64],
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Temperature of the joint, °C.
    pub temperature: f64,
}

/// Finds `σ0` and `σ1` from a log.
pub(super) fn find(
    config: &FrictionConfig,
    log: &PreslidingLog,
    loaded: &Log,
    law: Option<&FrictionLaw>,
    (warnings, inputs): (&mut Vec<String>, &mut Vec<InputRecord>),
) -> Result<PreslidingFit, Error> {
    let file = loaded.log.name().to_owned();
    let presliding = |input: &InputRecord| InputRecord { kind: InputKind::Presliding, ..input.clone() };
    inputs.extend(loaded.source.inputs.iter().map(presliding));
    warnings.extend(crate::log::temperature_warnings(&loaded.log));
    let grid = on_grid(loaded)?;
    let unknown = || FrictionError::NoSteadyLaw { file: file.clone(), joint: log.joint.clone() };
    let signals = grid.joints.iter().find(|j| j.name == log.joint).ok_or_else(unknown)?;
    let law = law.ok_or_else(unknown)?;
    let warm = temperature(&log.joint, &grid.channels)
        .map_or(config.reference_temperature, |t| t.iter().sum::<f64>() / t.len() as f64);
    let test = PreslidingTest {
        log: &file,
        joint: &log.joint,
        inertia: log.inertia,
        offset: log.offset,
        effort_hold: log.effort_hold,
        effort: &signals.effort,
        position: &signals.position,
        rate_hz: grid.rate_hz,
        temperature: warm,
    };
    let mut out = fit_presliding(&test, law)?;
    out.curves.iter_mut().for_each(|c| c[0] += grid.start);
    Ok(out)
}

/// Finds `σ0` and `σ1` of a joint, its steady law being known.
///
/// The joint is simulated under the effort from rest; `ln σ0, ln σ1` minimise the squared difference of the positions, a
/// constant apart: a grid first, then pattern search. Standard deviations come from the parabola of the objective, its
/// residuals counted as correlated as they are.
///
/// # Errors
/// [`FrictionError`](crate::friction::FrictionError) for numbers that no search can start from. What the motion does not tell is said in the outcome.
pub fn fit_presliding(test: &PreslidingTest<'_>, law: &FrictionLaw) -> Result<PreslidingFit, Error> {
    let (low, high) =
        test.position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
    let mut out = PreslidingFit {
        log: test.log.to_owned(),
        joint: test.joint.to_owned(),
        outcome: Err(String::new()),
        motion: high - low,
        resolution: quantum(test.position),
        residual_rms: None,
        hold: None,
        curves: Vec::new(),
        simulations: 0,
    };
    if out.motion <= 0.0 || out.resolution > COARSE * out.motion {
        out.outcome = Err(format!(
            "not identifiable: positions have a resolution of {:.1e} and move by {:.1e}; the encoder is too coarse, one at \
             the motor is needed",
            out.resolution, out.motion
        ));
        return Ok(out);
    }
    let parts = law.parts();
    let parameters = [parts.bristles.as_slice(), parts.viscous.as_slice()];
    let table = SteadyTable::new(&parts.model, &parts.shape, parameters, test.temperature, LARGEST_SPEED)?;
    let holds: &[EffortHold] = match test.effort_hold {
        HoldName::Auto => &[EffortHold::Held, EffortHold::Linear],
        HoldName::Held => &[EffortHold::Held],
        HoldName::Linear => &[EffortHold::Linear],
    };
    let task = Task { test, table: &table, interval: 1.0 / test.rate_hz };
    let mut best: Option<Found> = None;
    for hold in holds {
        let found = task.search(*hold, out.motion, &mut out.simulations)?;
        if best.as_ref().is_none_or(|b| found.value < b.value) {
            best = Some(found);
        }
    }
    if let Some(found) = best {
        task.judge(&found, &mut out);
    }
    Ok(out)
}

/// A joint's log against its simulation.
struct Task<'a> {
    test: &'a PreslidingTest<'a>,
    table: &'a SteadyTable,
    interval: f64,
}

struct Found {
    hold: EffortHold,
    sigma: [f64; 2],
    value: f64,
    at_bound: bool,
}

impl Task<'_> {
    /// Measured less simulated positions, their mean taken out; `None` where the simulation has no numbers.
    fn residual(&self, hold: EffortHold, sigma: &[f64]) -> Option<Vec<f64>> {
        let joint = PreslidingJoint {
            inertia: self.test.inertia,
            offset: self.test.offset,
            stiffness: sigma[0],
            damping: sigma[1],
        };
        let simulated = presliding(&joint, self.table, self.test.effort, self.interval, hold).ok()?;
        let mut residual: Vec<f64> = self.test.position.iter().zip(&simulated).map(|(m, s)| m - s).collect();
        let mean = residual.iter().sum::<f64>() / residual.len() as f64;
        residual.iter_mut().for_each(|r| *r -= mean);
        residual.iter().all(|r| r.is_finite()).then_some(residual)
    }

    fn loss(&self, hold: EffortHold, sigma: &[f64]) -> f64 {
        self.residual(hold, sigma).map_or(f64::INFINITY, |r| r.iter().map(|r| r * r).sum())
    }

    fn search(&self, hold: EffortHold, motion: f64, simulations: &mut u64) -> Result<Found, Error> {
        let span = |x: &[f64]| {
            let (low, high) =
                x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(*x), b.max(*x)));
            high - low
        };
        // A spring that moves so far under such an effort, and its critical damping.
        let stiffness = (span(self.test.effort) / motion).max(1e-9);
        let guess = [stiffness, (stiffness * self.test.inertia).sqrt()];
        let (lower, upper) = (guess.map(|x| x / REACH), guess.map(|x| x * REACH));
        let objective = PointObjective::new(2, |x: &[f64]| self.loss(hold, x)).in_parallel();
        let mut start = guess.to_vec();
        let mut least = f64::INFINITY;
        let places: Vec<f64> =
            (0..GRID).map(|k| REACH.powf(1.6 * (k as f64 / (GRID - 1) as f64 - 0.5))).collect();
        let candidates: Vec<f64> = places
            .iter()
            .flat_map(|a| places.iter().flat_map(move |b| [guess[0] * a, guess[1] * b]))
            .collect();
        let mut values = vec![0.0; GRID * GRID];
        dynid_search::Objective::evaluate(&objective, &candidates, &mut values);
        *simulations += values.len() as u64;
        for (value, point) in values.iter().zip(candidates.chunks_exact(2)) {
            if *value < least {
                (least, start) = (*value, point.to_vec());
            }
        }
        let bounds = Bounds::new(lower.to_vec(), upper.to_vec())
            .and_then(|b| b.with_logarithmic(&[0, 1]))
            .map_err(|e| FrictionError::from(SearchError::from(e)))?;
        let settings = Settings { start: Some(start), ..Settings::default() };
        let algorithm: Algorithm = "gps".parse().map_err(FrictionError::from)?;
        let found = run(&algorithm, &objective, &bounds, &settings, &mut |_| ControlFlow::Continue(()))
            .map_err(FrictionError::from)?;
        *simulations += found.evaluations;
        let at_bound = (0..2)
            .any(|k| found.point[k] <= lower[k] * (1.0 + 1e-9) || found.point[k] >= upper[k] * (1.0 - 1e-9));
        Ok(Found { hold, sigma: [found.point[0], found.point[1]], value: found.value, at_bound })
    }

    fn judge(&self, found: &Found, out: &mut PreslidingFit) {
        let Some(residual) = self.residual(found.hold, &found.sigma) else {
            out.outcome = Err("not identifiable: the simulation has no finite positions".to_owned());
            return;
        };
        let n = residual.len() as f64;
        let rms = (found.value / n).sqrt();
        out.residual_rms = Some(rms);
        out.hold = Some(found.hold);
        let mean = self.test.position.iter().sum::<f64>() / n;
        let thin = residual.len().div_ceil(3000);
        out.curves = residual
            .iter()
            .zip(self.test.position)
            .enumerate()
            .step_by(thin)
            .map(|(k, (r, q))| [k as f64 * self.interval, q - mean, q - mean - r])
            .collect();
        let energy: f64 = residual.iter().map(|r| r * r).sum();
        let neighbours: f64 = residual.windows(2).map(|r| r[0] * r[1]).sum();
        let correlation = if energy > 0.0 { (neighbours / energy).clamp(0.0, 0.999) } else { 0.0 };
        let variance = rms * rms * (1.0 + correlation) / (1.0 - correlation);
        let of_logs = |u: &[f64]| self.loss(found.hold, &[u[0].exp(), u[1].exp()]);
        let at = found.sigma.map(f64::ln);
        let covariance = covariance_of_values(&of_logs, &at, &[0.02, 0.02], variance);
        out.simulations += 9;
        out.outcome = match covariance {
            _ if found.at_bound => {
                Err("not identifiable: the search ends at its bounds, the log leaves them open".to_owned())
            }
            None => Err("not identifiable: the motion leaves stiffness or damping open".to_owned()),
            Some(c) if c[(0, 0)].sqrt() > UNKNOWN || c[(1, 1)].sqrt() > UNKNOWN => Err(format!(
                "not identifiable: relative standard deviations are {:.0} % and {:.0} %",
                100.0 * c[(0, 0)].sqrt(),
                100.0 * c[(1, 1)].sqrt()
            )),
            Some(_) if rms > 0.2 * out.motion => Err(format!(
                "not identifiable: the simulation misses the motion by {:.0} % of it",
                100.0 * rms / out.motion
            )),
            Some(c) => Ok([0, 1].map(|k| (found.sigma[k], found.sigma[k] * c[(k, k)].sqrt()))),
        };
    }
}
