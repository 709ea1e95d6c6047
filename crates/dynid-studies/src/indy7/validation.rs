//! Rows 9 to 11 and what goes beyond: estimates at work on other trajectories, cold and hot.

use dynid::estimators::conditioning::PreparedLog;
use dynid::model::KnownElement;
use rayon::prelude::*;

use super::cyclic::find_cyclic;
use super::experiment::{Experiment, constant, trajectory};
use super::friction::{JointFriction, experiment};
use super::identification::{Identified, OURS, PAPER, regression, regression_of};
use super::one_shot::one_shot;
use super::robot::{Cycles, Indy7};
use super::settings::{PerJoint, Settings};
use crate::{RunSettings, StudyError};

/// Names of the validation trajectories.
pub(super) const NAMES: [&str; 3] = ["A", "B", "C"];
/// Seed of the validation logs, apart from those of identification.
const VALIDATION_SEED: u64 = 900;

/// Logs of the three trajectories at one temperature.
#[derive(Debug)]
pub(super) struct Validation {
    pub(super) logs: [PreparedLog; 3],
}

/// RMSE per trajectory and joint, N m.
pub(super) type Table = [PerJoint; 3];

impl Validation {
    pub(super) fn new(
        arm: &Indy7,
        settings: &Settings,
        temperature: f64,
        seed: u64,
    ) -> Result<Self, StudyError> {
        let logs: Vec<PreparedLog> = (0..3)
            .into_par_iter()
            .map(|k| {
                let rows = &settings.trajectories.validation[k];
                log(arm, settings, rows, temperature, VALIDATION_SEED + 10 * seed + k as u64)
            })
            .collect::<Result<_, StudyError>>()?;
        let [a, b, c] =
            logs.try_into().unwrap_or_else(|_| unreachable!("three trajectories give three logs"));
        Ok(Validation { logs: [a, b, c] })
    }

    /// By the paper's processing.
    pub(super) fn table(&self, found: &Identified, settings: &Settings) -> Result<Table, StudyError> {
        let [a, b, c] = &self.logs;
        Ok([found.rmse(a, settings)?, found.rmse(b, settings)?, found.rmse(c, settings)?])
    }

    /// Prediction and measurement through the same filter.
    pub(super) fn filtered_table(
        &self,
        found: &Identified,
        settings: &Settings,
    ) -> Result<Table, StudyError> {
        let [a, b, c] = &self.logs;
        let of = |log| found.filtered_rmse(log, settings);
        Ok([of(a)?, of(b)?, of(c)?])
    }
}

/// One period of a trajectory in the paper's form at the rate of the paper, torque ripple on.
pub(super) fn log(
    arm: &Indy7,
    settings: &Settings,
    rows: &[Vec<f64>],
    temperature: f64,
    seed: u64,
) -> Result<PreparedLog, StudyError> {
    let experiment = Experiment {
        trajectory: &trajectory(rows)?,
        temperature: constant(temperature)?,
        ripple: true,
        rate_hz: settings.simulation.rate_hz,
        seed,
    };
    experiment.prepared("virtual log", arm, settings)
}

/// Friction of all joints as elements; `stated`: joint and temperature in place of the measured one.
pub(super) fn known(
    friction: &[JointFriction],
    settings: &Settings,
    stated: Option<(usize, f64)>,
) -> Result<Vec<KnownElement>, StudyError> {
    let mut out = Vec::new();
    for (joint, found) in friction.iter().enumerate() {
        let stated = stated.filter(|(j, _)| *j == joint).map(|(_, t)| t);
        out.extend(found.known(joint, settings.thermal.valid, stated)?);
    }
    Ok(out)
}

/// Errors on the validation logs where prediction and measurement pass the same filter, cold and hot.
pub(super) type Scores = [Table; 2];

/// Validation at both ends of the temperatures.
#[derive(Debug)]
pub(super) struct Ends {
    pub(super) cold: Validation,
    pub(super) hot: Validation,
}

impl Ends {
    pub(super) fn named(&self) -> [(&'static str, &Validation); 2] {
        [("cold", &self.cold), ("hot", &self.hot)]
    }

    fn scores(&self, found: &Identified, settings: &Settings) -> Result<Scores, StudyError> {
        let (cold, hot) = rayon::join(
            || self.cold.filtered_table(found, settings),
            || self.hot.filtered_table(found, settings),
        );
        Ok([cold?, hot?])
    }
}

/// An estimate with its errors.
#[derive(Debug)]
pub(super) struct Scored {
    pub(super) found: Identified,
    pub(super) scores: Scores,
}

/// Everything that one seed gives.
#[derive(Debug)]
pub(super) struct Realisation {
    pub(super) friction: Vec<JointFriction>,
    pub(super) conventional: Scored,
    /// By the paper's constraints.
    pub(super) proposed: Scored,
    /// Bodies that can exist, errors of friction of any sign.
    pub(super) two_step: Scored,
    /// With the ripple that residuals show.
    pub(super) one_shot: Scored,
    /// Without ripple; not in quick runs.
    pub(super) plain_one_shot: Option<Scored>,
    /// Orders of that ripple.
    pub(super) cycles: Cycles,
}

/// Most repetitions per turn of a ripple that is looked for, and the least share of held-out squares that it must explain.
const RIPPLE: (u32, f64) = (6, 0.1);

/// Rounds in which further orders are looked for.
const ROUNDS: usize = 4;

/// Orders of the ripple that residuals show: the two-step regression again and again with the orders found so far among its
/// columns, until nothing more shows.
fn ripple(
    arm: &Indy7,
    friction: &[JointFriction],
    log: &PreparedLog,
    settings: &Settings,
) -> Result<Cycles, StudyError> {
    let (most, least) = RIPPLE;
    let mut cycles: Cycles = std::array::from_fn(|_| Vec::new());
    for _ in 0..ROUNDS {
        let model = arm.regression_with(&cycles).with_known(known(friction, settings, None)?);
        let found = regression_of(arm, model, log, settings, OURS)?;
        let filtered = found.filtered(log, settings)?;
        let mut more = false;
        for (joint, orders) in cycles.iter_mut().enumerate() {
            let seen = &filtered[joint];
            let order = find_cyclic(&seen.position, &seen.error(), most, least).map(|f| f.cycles);
            if let Some(order) = order.filter(|o| !orders.contains(o)) {
                orders.push(order);
                more = true;
            }
        }
        if !more {
            break;
        }
    }
    Ok(cycles)
}

/// Friction experiment and identification at the moderate temperature.
pub(super) fn realisation(
    arm: &Indy7,
    settings: &Settings,
    excitation: &[Vec<f64>],
    ends: &Ends,
    run: &RunSettings,
    seed: u64,
) -> Result<Realisation, StudyError> {
    let (friction, log) = rayon::join(
        || experiment(arm, settings, run, seed),
        || log(arm, settings, excitation, settings.thermal.moderate, seed),
    );
    let (friction, log) = (friction?, log?);
    let known = || known(&friction, settings, None);
    let conventional = regression(arm, Vec::new(), &log, settings, PAPER)?;
    let proposed = regression(arm, known()?, &log, settings, PAPER)?;
    let two_step = regression(arm, known()?, &log, settings, OURS)?;
    let cycles = ripple(arm, &friction, &log, settings)?;
    let starts = friction.iter().enumerate().map(|(j, f)| f.start(j, settings.thermal.valid));
    let starts = starts.collect::<Result<Vec<_>, _>>()?;
    let points: Vec<_> = friction.iter().enumerate().flat_map(|(j, f)| f.rows(j)).collect();
    let plain = || one_shot(arm, starts.clone(), &points, &Cycles::default(), &log, OURS);
    let plain = || (!run.quick).then(plain).transpose();
    let (one_shot, plain) =
        rayon::join(|| one_shot(arm, starts.clone(), &points, &cycles, &log, OURS), plain);
    let scored = |found: Identified| -> Result<Scored, StudyError> {
        Ok(Scored { scores: ends.scores(&found, settings)?, found })
    };
    Ok(Realisation {
        conventional: scored(conventional)?,
        proposed: scored(proposed)?,
        two_step: scored(two_step)?,
        one_shot: scored(one_shot?)?,
        plain_one_shot: plain?.map(scored).transpose()?,
        friction,
        cycles,
    })
}

/// Share of the error that is gone, per trajectory and joint.
pub(super) fn improvement(before: &Table, after: &Table) -> [PerJoint; 3] {
    std::array::from_fn(|k| std::array::from_fn(|j| 1.0 - after[k][j] / before[k][j]))
}

/// Base values that change by more than a fifth from one estimate to another; those of 0.001 and less count as 0.001.
pub(super) fn changed(cold: &[f64], hot: &[f64]) -> usize {
    cold.iter().zip(hot).filter(|(a, b)| (*a - *b).abs() > 0.2 * a.abs().max(1e-3)).count()
}
