//! Step 1: the friction experiment of every joint.

use dynid::estimators::steady_friction::{SteadyFriction, SteadyPoint, SteadySettings, analyse};
use dynid::motion::Log;
use dynid::motion::constant_speed::{PairSettings, Pass, SegmentSettings, pair, segments};
use rayon::prelude::*;

use super::robot::{Indy7, SingleJoint};
use super::settings::Settings;
use super::sweep::{levels, sweep};
use super::{JOINTS, fault};
use crate::{RunSettings, StudyError};

/// What the experiment of one joint gave.
#[derive(Debug)]
pub(super) struct JointFriction {
    pub(super) points: Vec<SteadyPoint>,
    pub(super) fit: SteadyFriction,
}

/// Sweeps of all joints at all temperatures, and their fits.
pub(super) fn experiment(
    arm: &Indy7,
    settings: &Settings,
    run: &RunSettings,
    seed: u64,
) -> Result<Vec<JointFriction>, StudyError> {
    let speeds = levels(16);
    let temperatures: Vec<f64> = match run.quick {
        true => settings.thermal.levels.iter().copied().step_by(3).collect(),
        false => settings.thermal.levels.clone(),
    };
    (0..JOINTS)
        .into_par_iter()
        .map(|joint| {
            let single = SingleJoint::new(settings, arm, joint)?;
            let logs = temperatures.par_iter().enumerate().map(|(k, t)| {
                let seed = seed * 1000 + (joint * 50 + k) as u64;
                sweep(joint, &single, settings, (*t, &speeds), seed)
            });
            let logs: Vec<Log> = logs.collect::<Result<_, StudyError>>()?;
            let points = points(&logs)?;
            let fit = analyse(&points, &SteadySettings::default()).map_err(fault)?;
            Ok(JointFriction { points, fit })
        })
        .collect()
}

/// Friction at every speed and temperature from passes in both directions.
fn points(logs: &[Log]) -> Result<Vec<SteadyPoint>, StudyError> {
    let mut passes = Vec::new();
    for log in logs {
        let joint = &log.joints()[0];
        let temperature = &log.channels()[0].values;
        for segment in segments(log.time(), joint, &SegmentSettings::default()).map_err(fault)? {
            passes.push(Pass {
                speed: segment.speed,
                position: &joint.position[segment.rows.clone()],
                effort: &joint.effort[segment.rows.clone()],
                temperature: Some(&temperature[segment.rows]),
            });
        }
    }
    let pairing = pair(&passes, &PairSettings::default()).map_err(fault)?;
    let points = pairing.points.iter().map(|p| SteadyPoint {
        speed: p.speed,
        temperature: p.temperature,
        friction: p.friction,
        std: p.std,
    });
    Ok(points.collect())
}
