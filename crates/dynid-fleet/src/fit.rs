//! From a fleet to its parameters.

use std::sync::Arc;

use dynid_linalg::Mat;
use rayon::prelude::*;

use crate::colour::colours;
use crate::data::{FEW, Fleet, FleetError, FleetLog};
use crate::jackknife;
use crate::noise::Noise;
use crate::split::{Splits, means, places};
use crate::spread::{LEFT_OUT, Variances};
use crate::sweep::{RobotState, Sweep};
use crate::variances::{Settled, VarianceSettings, maximise};

/// Relative spread at the start, between robots and between logs.
const START: (f64, f64) = (0.2, 0.05);
/// Sweeps of the rounds in which the colour of the noise settles ...
const ROUGH_PASSES: usize = 4;
/// ... and change at which they, and the search for outliers, end: weights need no more.
const ROUGH: f64 = 0.03;
/// The scale of Student's t with four degrees of freedom is that of normal deviations over about the root of this.
const NORMAL: f64 = 1.4;
/// A parameter starts with the spread that it had if its size were this share of what would explain all efforts alone.
const LEAST_SIZE: f64 = 0.05;

/// How a fleet is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct FitSettings {
    /// Degrees of freedom of Student's t by which outliers are found.
    pub freedom: f64,
    /// A coordinate of a robot with less weight than this is named and left out of the spread.
    pub robot_weight: f64,
    /// A coordinate of a log, alike.
    pub log_weight: f64,
    /// Rounds of variances and colour of the noise.
    pub rounds: usize,
    /// Robots that tell the colour of the noise, where there are more: the median over their logs does not get better by many.
    pub colour_robots: usize,
    /// How variances are found, but for the degrees of freedom.
    pub variances: VarianceSettings,
    /// Rows `[W y]` of what was known of the columns before any log, over one another: a weak prior where logs tell too little.
    pub prior: Option<Mat>,
}

impl Default for FitSettings {
    fn default() -> Self {
        FitSettings {
            freedom: 4.0,
            robot_weight: 0.3,
            log_weight: 0.2,
            rounds: 3,
            colour_robots: 96,
            variances: VarianceSettings::default(),
            prior: None,
        }
    }
}

/// A robot of the fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotFit {
    /// Its parameters in the order of the columns, at the mean of the covariates.
    pub values: Vec<f64>,
    /// Their covariance, `p × p`.
    pub covariance: Mat,
    /// Per coordinate: its deviation from the type.
    pub deviation: Vec<f64>,
    /// Per coordinate: standard deviation of that.
    pub deviation_sd: Vec<f64>,
    /// Per coordinate: weight by Student's t, about 1 for a robot like the others.
    pub weights: Vec<f64>,
}

/// A log of the fleet.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFit {
    /// Per coordinate: its deviation from the robot.
    pub deviation: Vec<f64>,
    /// Per coordinate: standard deviation of that.
    pub deviation_sd: Vec<f64>,
    /// Per coordinate: weight by Student's t.
    pub weights: Vec<f64>,
}

/// A fleet that was fitted.
#[derive(Debug)]
pub struct FleetFit {
    /// Noise of the rows.
    pub noise: Noise,
    /// Spread of the coordinates; weights [`LEFT_OUT`] where a coordinate of a robot or log was named.
    pub variances: Variances,
    /// Spread by Student's t, and the weights by which outliers are named.
    pub robust: Variances,
    /// Whether the variances settled.
    pub settled: Settled,
    /// Parameters of the type in the order of the columns, at the mean of the covariates.
    pub values: Vec<f64>,
    /// Their covariance if the model is right, `p × p`.
    pub covariance: Mat,
    /// Their covariance by leaving out one robot after the other; `None` where the others do not tell all parameters.
    pub jackknife: Option<Mat>,
    /// Per robot: by how many standard deviations (jackknife) it moves the parameter it moves most; 0 without logs.
    pub influence: Vec<f64>,
    /// Per covariate: its mean over the logs.
    pub covariate_means: Vec<f64>,
    /// Per covariate and coordinate: change of the coordinate per unit of the covariate.
    pub slopes: Vec<Vec<f64>>,
    /// Their standard deviations.
    pub slope_sds: Vec<Vec<f64>>,
    /// Per robot; `None` without logs.
    pub robots: Vec<Option<RobotFit>>,
    /// Per log.
    pub logs: Vec<LogFit>,
    /// Minus twice the restricted log likelihood at the variances, but for a constant.
    pub m2l: f64,
    /// Degrees of freedom of Student's t.
    pub(crate) freedom: f64,
    pub(crate) splits: Arc<Splits>,
    pub(crate) prior: Option<Mat>,
}

/// Fits a fleet: variances by restricted maximum likelihood with Student's t and the colour of the noise in turns, then with normal
/// deviations without the coordinates that stand out.
///
/// # Errors
/// [`FleetError`].
pub fn fit(fleet: &Fleet, settings: &FitSettings) -> Result<FleetFit, FleetError> {
    fleet.check()?;
    let mut noise = Noise::of(fleet);
    let heavy = VarianceSettings {
        freedom: Some(settings.freedom),
        tolerance: settings.variances.tolerance.max(ROUGH),
        ..settings.variances.clone()
    };
    let sample = sample(fleet, settings.colour_robots);
    let (colours, from) = coloured(sample.as_ref().unwrap_or(fleet), settings, &heavy)?;
    noise.colours = colours;
    let splits = Splits::new(fleet, &noise);
    let prior = settings.prior.as_ref().map(|prior| in_order(&splits, prior));
    let number = (fleet.robots.len(), fleet.logs.len());
    let start = Variances::new(from.start.robots.clone(), from.start.logs.clone(), number);
    let robust = match sample {
        None => from.robust,
        Some(_) => Variances::new(from.robust.robots, from.robust.logs, number),
    };
    let (robust, _) = maximise(fleet, &splits, (&start, robust), &heavy, prior.as_ref())?;
    let few = splits.robots.len() < FEW;
    let without = Variances {
        robot_weights: named(&robust.robot_weights, if few { 0.0 } else { settings.robot_weight }),
        log_weights: named(
            &robust.log_weights,
            if fleet.logs.len() < FEW { 0.0 } else { settings.log_weight },
        ),
        robots: robust.robots.iter().map(|v| NORMAL * v).collect(),
        logs: robust.logs.iter().map(|v| NORMAL * v).collect(),
    };
    let normal = VarianceSettings { freedom: None, ..settings.variances.clone() };
    let (variances, settled) = maximise(fleet, &splits, (&start, without), &normal, prior.as_ref())?;
    finish(fleet, Found { noise, splits, variances, robust, settled, prior }, settings.freedom)
}

/// Variances with which the colour of the noise was found.
struct Coloured {
    start: Variances,
    robust: Variances,
}

/// Colour of the noise and variances by Student's t in turns.
fn coloured(
    fleet: &Fleet,
    settings: &FitSettings,
    heavy: &VarianceSettings,
) -> Result<(Vec<f64>, Coloured), FleetError> {
    let mut noise = Noise::of(fleet);
    let mut splits = Splits::new(fleet, &noise);
    let prior = settings.prior.as_ref().map(|prior| in_order(&splits, prior));
    let start = start(fleet, &splits, prior.as_ref())?;
    let mut robust = start.clone();
    for round in 0..settings.rounds {
        if round > 0 {
            splits = Splits::new(fleet, &noise);
        }
        let rough = VarianceSettings { passes: ROUGH_PASSES, ..heavy.clone() };
        (robust, _) = maximise(fleet, &splits, (&start, robust), &rough, prior.as_ref())?;
        noise.colours = colours(fleet, &noise, &Sweep::new(&splits, &robust, prior.as_ref())?);
    }
    Ok((noise.colours, Coloured { start, robust }))
}

/// Some robots of a fleet, evenly among the keys of those with logs; `None` if there are no more than these.
fn sample(fleet: &Fleet, robots: usize) -> Option<Fleet> {
    let by_robot = fleet.by_robot();
    let mut all: Vec<usize> = (0..fleet.robots.len()).filter(|r| !by_robot[*r].is_empty()).collect();
    if all.len() <= robots {
        return None;
    }
    all.sort_unstable_by_key(|r| fleet.robots[*r]);
    let taken: Vec<usize> = (0..robots).map(|k| all[k * all.len() / robots]).collect();
    let renamed = |(at, r): (usize, &usize)| {
        by_robot[*r].iter().map(move |k| FleetLog { robot: at, ..fleet.logs[*k].clone() })
    };
    Some(Fleet {
        robots: taken.iter().map(|r| fleet.robots[*r]).collect(),
        logs: taken.iter().enumerate().flat_map(renamed).collect(),
        varying: fleet.varying.clone(),
        ..*fleet
    })
}

/// The fleet at variances and noise that are given; nothing is left out or found.
///
/// # Errors
/// [`FleetError`].
pub fn fit_at(fleet: &Fleet, noise: Noise, variances: Variances) -> Result<FleetFit, FleetError> {
    fleet.check()?;
    let splits = Splits::new(fleet, &noise);
    let settled = Settled { passes: 0, change: 0.0, converged: true };
    finish(
        fleet,
        Found { noise, splits, robust: variances.clone(), variances, settled, prior: None },
        FitSettings::default().freedom,
    )
}

/// Variances of normal deviations by restricted maximum likelihood, from a start, at noise that is given.
///
/// # Errors
/// [`FleetError`].
pub fn variances_at(
    fleet: &Fleet,
    noise: &Noise,
    start: &Variances,
    settings: &VarianceSettings,
) -> Result<(Variances, Settled), FleetError> {
    fleet.check()?;
    maximise(fleet, &Splits::new(fleet, noise), (start, start.clone()), settings, None)
}

/// What a fit found before it is told.
pub(crate) struct Found {
    pub(crate) noise: Noise,
    pub(crate) splits: Splits,
    pub(crate) variances: Variances,
    pub(crate) robust: Variances,
    pub(crate) settled: Settled,
    pub(crate) prior: Option<Mat>,
}

fn named(weights: &[Vec<f64>], least: f64) -> Vec<Vec<f64>> {
    let weight = |w: &f64| if *w < least { LEFT_OUT } else { 1.0 };
    weights.iter().map(|own| own.iter().map(weight).collect()).collect()
}

/// Prior rows over columns and effort in the order of the fit, slopes between.
fn in_order(splits: &Splits, prior: &Mat) -> Mat {
    let slopes = splits.q * splits.covariates;
    let p = splits.order.len();
    Mat::from_fn(prior.nrows(), p + slopes + 1, |i, j| match j {
        _ if j < splits.q => prior[(i, splits.order[j])],
        _ if j < splits.q + slopes => 0.0,
        _ if j < p + slopes => prior[(i, splits.order[j - slopes])],
        _ => prior[(i, p)],
    })
}

/// Variances to start from: a share of the size of the parameter, which a fit of all logs together tells.
fn start(fleet: &Fleet, splits: &Splits, prior: Option<&Mat>) -> Result<Variances, FleetError> {
    let q = splits.q;
    let number = (fleet.robots.len(), fleet.logs.len());
    let none = Variances::new(vec![0.0; q], vec![0.0; q], number);
    let pooled = Sweep::new(splits, &none, prior)?;
    let mut least = vec![f64::INFINITY; fleet.columns];
    for channel in fleet.logs.iter().flat_map(|log| &log.channels) {
        for (norm, column) in channel.factor.column_norms().into_iter().zip(&channel.columns) {
            if norm > 0.0 {
                least[*column] = least[*column].min(channel.factor.effort_norm() / norm);
            }
        }
    }
    let size = |k: usize| {
        let least = least[fleet.varying[k].column];
        let least = if least.is_finite() { LEAST_SIZE * least } else { 0.0 };
        pooled.theta[k].abs().max(least).max(f64::MIN_POSITIVE.sqrt())
    };
    let alone = splits.by_robot.iter().all(|logs| logs.len() < 2);
    let robots =
        (0..q).map(|k| if fleet.varying[k].between_robots { (START.0 * size(k)).powi(2) } else { 0.0 });
    // One log a robot: what differs between logs cannot be told from what differs between robots.
    let between_logs =
        |k: usize| fleet.varying[k].between_logs && !(alone && fleet.varying[k].between_robots);
    let logs = (0..q).map(|k| if between_logs(k) { (START.1 * size(k)).powi(2) } else { 0.0 });
    Ok(Variances::new(robots.collect(), logs.collect(), number))
}

pub(crate) fn finish(fleet: &Fleet, found: Found, freedom: f64) -> Result<FleetFit, FleetError> {
    let Found { noise, splits, variances, robust, settled, prior } = found;
    let splits = Arc::new(splits);
    let sweep = Sweep::new(&splits, &variances, prior.as_ref())?;
    let (q, slopes) = (splits.q, splits.q * splits.covariates);
    let place = places(&splits.order);
    // Of a column, its place among the parameters of the fit.
    let at = |column: usize| if place[column] < q { place[column] } else { place[column] + slopes };
    let p = fleet.columns;
    let in_columns = |matrix: &Mat| Mat::from_fn(p, p, |i, j| matrix[(at(i), at(j))]);
    let jackknife = jackknife::over_robots(&sweep, prior.as_ref());
    let mut influence = vec![0.0; fleet.robots.len()];
    if let Some(jackknife) = &jackknife {
        for ((_, r), moves) in splits.robots.iter().zip(&jackknife.moves) {
            let share = |i: usize| moves[i].abs() / jackknife.covariance[(i, i)].sqrt();
            influence[*r] = (0..moves.len()).map(share).filter(|s| s.is_finite()).fold(0.0, f64::max);
        }
    }
    let sds = |c: usize| (0..q).map(|k| sweep.covariance[(q + c * q + k, q + c * q + k)].sqrt()).collect();
    let told = |r: usize| {
        if splits.by_robot[r].is_empty() {
            return (None, Vec::new());
        }
        let state: RobotState = sweep.robot(r);
        let sd = |d: &crate::sweep::Deviation| (0..q).map(|k| d.variance(k).max(0.0).sqrt()).collect();
        let logs: Vec<(usize, LogFit)> = (splits.by_robot[r].iter())
            .map(|k| {
                let deviation = sweep.log(*k, &state);
                let (deviation_sd, weights) = (sd(&deviation), robust.log_weights[*k].clone());
                (*k, LogFit { deviation: deviation.mean, deviation_sd, weights })
            })
            .collect();
        let robot = RobotFit {
            values: (0..p).map(|c| state.values[at(c)]).collect(),
            covariance: in_columns(&state.covariance),
            deviation_sd: sd(&state.deviation),
            deviation: state.deviation.mean,
            weights: robust.robot_weights[r].clone(),
        };
        (Some(robot), logs)
    };
    let (robots, of_robots): (Vec<_>, Vec<_>) = (0..fleet.robots.len()).into_par_iter().map(told).unzip();
    let mut logs: Vec<(usize, LogFit)> = of_robots.into_iter().flatten().collect();
    logs.sort_unstable_by_key(|(k, _)| *k);
    Ok(FleetFit {
        values: (0..p).map(|c| sweep.theta[at(c)]).collect(),
        covariance: in_columns(&sweep.covariance),
        jackknife: jackknife.map(|j| in_columns(&j.covariance)),
        influence,
        covariate_means: means(fleet),
        slopes: (0..fleet.covariates).map(|c| sweep.theta[q + c * q..q + (c + 1) * q].to_vec()).collect(),
        slope_sds: (0..fleet.covariates).map(sds).collect(),
        robots,
        logs: logs.into_iter().map(|(_, log)| log).collect(),
        m2l: sweep.m2l,
        noise,
        variances: variances.clone(),
        robust: robust.clone(),
        settled,
        freedom,
        splits: Arc::clone(&splits),
        prior: prior.clone(),
    })
}

impl FleetFit {
    /// What is known of a further robot of the type before its first log: `x ~ N(θ, C_θ + E D_b Eᵀ)`.
    pub fn new_robot(&self) -> Expected {
        let mut covariance = self.covariance.clone();
        for (k, column) in self.splits.order[..self.splits.q].iter().enumerate() {
            covariance[(*column, *column)] += self.variances.robots[k];
        }
        Expected { values: self.values.clone(), covariance }
    }
}

/// Parameters that are expected, and their covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Expected {
    /// Values in the order of the columns.
    pub values: Vec<f64>,
    /// Covariance, `p × p`.
    pub covariance: Mat,
}
