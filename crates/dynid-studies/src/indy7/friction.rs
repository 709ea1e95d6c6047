//! Step 1: the friction experiment of every joint.

use dynid::estimators::separable::SteadyFrictionRow;
use dynid::estimators::steady_friction::{FrictionLaw, SteadyFriction, SteadyPoint, SteadySettings, analyse};
use dynid::friction::{HoldName, PreslidingTest, fit_presliding};
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

    /// Elements with these values, `stated`: a temperature in place of the measured one.
    pub(super) fn known(
        &self,
        rate: usize,
        valid: [f64; 2],
        stated: Option<f64>,
    ) -> Result<[KnownElement; 2], StudyError> {
        let (fc, fs, [(sigma0, _), (sigma1, _)]) = (self.value("fc")?, self.value("fs")?, self.bristles);
        let held = |symbol: &str| Ok::<_, StudyError>(ShapeSetting::held(self.value(symbol)?));
        let slope = |symbol: &str| ShapeSetting::held(self.fit.law.value(symbol).unwrap_or(0.0));
        let bristles = LuGre {
            rate,
            kappa: ShapeSetting::held(sigma0 / fc),
            rho: ShapeSetting::held(fs / fc),
            vs: held("vs")?,
            delta: ShapeSetting::held(2.0),
        };
        let viscous = ExponentialViscous {
            rate,
            sigma3: held("sigma3")?,
            sigma3_slope: slope("sigma3_slope"),
            sigma4: held("sigma4")?,
            sigma4_slope: slope("sigma4_slope"),
            reference_temperature: self.fit.law.reference_temperature,
            temperature_range: (valid[0], valid[1]),
            temperature: stated,
        };
        let amplitude = vec![self.value("sigma2")?, self.fit.law.value("sigma2_slope").unwrap_or(0.0)];
        Ok([
            KnownElement { element: Box::new(bristles), linear: vec![fc, sigma1], shape: Vec::new() },
            KnownElement { element: Box::new(viscous), linear: amplitude, shape: Vec::new() },
        ])
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
            Ok(JointFriction { points, fit, bristles })
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
