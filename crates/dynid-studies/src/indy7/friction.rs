//! Step 1: the friction experiment of every joint.

use dynid::estimators::separable::SteadyFrictionRow;
use dynid::estimators::steady_friction::{FrictionLaw, SteadyFriction, SteadyPoint, SteadySettings, analyse};
use dynid::friction::model::BristleModel;
use dynid::friction::{HoldName, KnownFriction, PreslidingTest, fit_presliding};
use dynid::model::KnownElement;
use dynid::model::element::{ExponentialViscous, LuGre, ShapeSetting};
use dynid::motion::Log;
use dynid::motion::constant_speed::{PairSettings, Pass, SegmentSettings, pair, segments};
use rayon::prelude::*;

use super::one_shot::FrictionStart;
use super::robot::{Indy7, SingleJoint};
use super::settings::Settings;
use super::sweep::{levels, presliding, sweep};
use super::{JOINTS, fault};
use crate::{RunSettings, StudyError};

/// What the experiment of one joint gave.
#[derive(Debug)]
pub(super) struct JointFriction {
    joint: String,
    pub(super) points: Vec<SteadyPoint>,
    pub(super) fit: SteadyFriction,
    /// `σ0, σ1` with standard deviations.
    pub(super) bristles: [(f64, f64); 2],
}

/// A missing coefficient.
fn lacking(symbol: &str) -> StudyError {
    fault(format!("the friction experiment gives no `{symbol}`"))
}

impl JointFriction {
    fn value(&self, symbol: &str) -> Result<f64, StudyError> {
        self.fit.law.value(symbol).ok_or_else(|| lacking(symbol))
    }

    /// Elements of these laws, `stated`: a temperature in place of the measured one.
    pub(super) fn known(
        &self,
        rate: usize,
        valid: [f64; 2],
        stated: Option<f64>,
    ) -> Result<Vec<KnownElement>, StudyError> {
        let [(sigma0, _), (sigma1, _)] = self.bristles;
        let law = KnownFriction::of_law(&self.joint, &self.fit.law).ok_or_else(|| lacking("fc"))?;
        let known = KnownFriction {
            bristle: Some(BristleModel { sigma0, sigma1, prior: false }),
            temperature_range: Some(valid),
            temperature: stated,
            ..law
        };
        Ok(known.elements(rate))
    }

    /// Where a fit of friction together with inertias starts: all but the bristles' stiffness is free.
    pub(super) fn start(&self, rate: usize, valid: [f64; 2]) -> Result<FrictionStart, StudyError> {
        let (fc, fs) = (self.value("fc")?, self.value("fs")?);
        let free = |x: f64| ShapeSetting { start: x, lower: 0.2 * x, upper: 5.0 * x, held: false };
        let slope = |symbol: &str| {
            let start = self.fit.law.value(symbol).unwrap_or(0.0);
            ShapeSetting { start, lower: start - 0.05, upper: start + 0.05, held: false }
        };
        Ok(FrictionStart {
            bristles: LuGre {
                rate,
                kappa: ShapeSetting::held(self.bristles[0].0 / fc),
                rho: free(fs / fc),
                vs: free(self.value("vs")?),
                delta: ShapeSetting::held(2.0),
            },
            viscous: ExponentialViscous {
                sigma3: free(self.value("sigma3")?),
                sigma3_slope: slope("sigma3_slope"),
                sigma4: free(self.value("sigma4")?),
                sigma4_slope: slope("sigma4_slope"),
                reference_temperature: self.fit.law.reference_temperature,
                temperature_range: (valid[0], valid[1]),
                ..ExponentialViscous::new(rate)
            },
        })
    }

    /// Points as rows of a fit.
    pub(super) fn rows(&self, output: usize) -> impl Iterator<Item = SteadyFrictionRow> {
        self.points.iter().zip(&self.fit.std).map(move |(p, std)| SteadyFrictionRow {
            output,
            speed: p.speed,
            temperature: p.temperature.unwrap_or(self.fit.law.reference_temperature),
            friction: p.friction,
            std: *std,
        })
    }
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
            let bristles = bristles(joint, &single, settings, &fit.law, seed)?;
            Ok(JointFriction { joint: single.name, points, fit, bristles })
        })
        .collect()
}

/// Stiffness and damping of the bristles from motion within friction.
fn bristles(
    joint: usize,
    single: &SingleJoint,
    settings: &Settings,
    law: &FrictionLaw,
    seed: u64,
) -> Result<[(f64, f64); 2], StudyError> {
    let temperature = settings.thermal.moderate;
    let (log, offset) = presliding(joint, single, settings, temperature, seed * 1000 + 500 + joint as u64)?;
    let signals = &log.joints()[0];
    let test = PreslidingTest {
        log: log.name(),
        joint: &single.name,
        inertia: single.inertia()?,
        offset,
        effort_hold: HoldName::Held,
        effort: &signals.effort,
        position: &signals.position,
        rate_hz: (log.rows() - 1) as f64 / (log.time()[log.rows() - 1] - log.time()[0]),
        temperature,
    };
    fit_presliding(&test, law)?.outcome.map_err(fault)
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
