//! Constant-speed tests under a brake, by inverse simulation, and what sensors make of them.

use std::f64::consts::TAU;

use dynid::model::{EffortModel, MotionBlock, RegressorBlock, RobotModel};
use dynid::motion::filter::{butterworth, forward_backward, pick};
use dynid::motion::trajectory::{PaulBlend, Profile};
use dynid::sim::{ElasticInverse, LinkMotion};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::joint::{Extras, LINK, MOTOR, simulated};
use super::settings::{Noise, Settings};
use super::{Values, fault};
use crate::StudyError;

/// Order of the low-pass that goes before cubing.
const FILTER_ORDER: usize = 4;

/// What is recorded of a cruise, a value per sample.
#[derive(Debug, Clone, Default)]
pub(super) struct Signals {
    /// Position of the link, rad.
    pub(super) position: Vec<f64>,
    /// `θ/N - q`, rad.
    pub(super) deformation: Vec<f64>,
    pub(super) motor_speed: Vec<f64>,
    pub(super) link_speed: Vec<f64>,
    pub(super) motor_acceleration: Vec<f64>,
    pub(super) motor_torque: Vec<f64>,
    /// Reading of the torque sensor.
    pub(super) link_torque: Vec<f64>,
}

impl Signals {
    /// A cruise at `speed` (of the link, rad/s) for `cruise_s` seconds without noise.
    pub(super) fn cruise(
        settings: &Settings,
        values: &Values,
        extras: Extras,
        (speed, cruise_s, rate_hz): (f64, f64, f64),
    ) -> Result<Self, StudyError> {
        let programme = &settings.programme;
        let (model, linear) = simulated(settings, values, extras);
        let shape: Vec<f64> = model.parameters().shape_start();
        let inverse = ElasticInverse::new(&model, &linear, &shape, 0.0)?;
        let path = PaulBlend::constant_velocity(0.0, speed, programme.blend_s, cruise_s)?;
        let (start, end) = path.cruise();
        let w = TAU / programme.load_period_s;
        let mut out = Signals::default();
        for k in 0..=((end - start) * rate_hz).round() as usize {
            let t = start + k as f64 / rate_hz;
            let point = path.at(t);
            // The whole record lies in the cruise, where nothing accelerates.
            let link: LinkMotion = [point.position, point.velocity, 0.0, 0.0, 0.0];
            let (sine, cosine) = (w * t).sin_cos();
            let size = programme.load_amplitude;
            let brake = [programme.load_mean - size * cosine, size * w * sine, size * w * w * cosine];
            let motion = inverse.at(&[link], &[brake])?;
            out.position.push(motion.q[LINK]);
            out.deformation.push(motion.deformation[0][0]);
            out.motor_speed.push(motion.dq[MOTOR]);
            out.link_speed.push(motion.dq[LINK]);
            out.motor_acceleration.push(motion.ddq[MOTOR]);
            out.motor_torque.push(motion.effort[MOTOR]);
            out.link_torque.push(brake[0] * speed.signum());
        }
        Ok(out)
    }

    /// All cruises of the programme without noise.
    pub(super) fn programme(
        settings: &Settings,
        values: &Values,
        extras: Extras,
        rate_hz: f64,
    ) -> Result<Vec<Self>, StudyError> {
        let cruise_s = settings.programme.cruise_s;
        let one = |speed: f64| Self::cruise(settings, values, extras, (speed, cruise_s, rate_hz));
        settings.programme.speeds().into_iter().map(one).collect()
    }

    pub(super) fn len(&self) -> usize {
        self.deformation.len()
    }

    /// With white noise on what sensors measure.
    pub(super) fn noisy(&self, noise: &Noise, random: &mut ChaCha8Rng) -> Self {
        let mut out = self.clone();
        let measured = [
            (&mut out.deformation, noise.deformation),
            (&mut out.motor_torque, noise.motor_torque),
            (&mut out.link_torque, noise.link_torque),
            (&mut out.motor_speed, noise.motor_speed),
            (&mut out.link_speed, noise.link_speed),
        ];
        for (signal, std) in measured {
            for value in signal {
                let white: f64 = StandardNormal.sample(random);
                *value += std * white;
            }
        }
        out
    }

    /// All that is measured through a zero-phase low-pass.
    pub(super) fn filtered(&self, cutoff_hz: f64, rate_hz: f64) -> Result<Self, StudyError> {
        let filter = butterworth(FILTER_ORDER, cutoff_hz, rate_hz).map_err(fault)?;
        let pass = |signal: &[f64]| forward_backward(&filter, signal).map_err(fault);
        Ok(Signals {
            deformation: pass(&self.deformation)?,
            motor_speed: pass(&self.motor_speed)?,
            link_speed: pass(&self.link_speed)?,
            motor_torque: pass(&self.motor_torque)?,
            link_torque: pass(&self.link_torque)?,
            ..self.clone()
        })
    }

    /// Every `factor`-th sample.
    pub(super) fn decimated(&self, factor: usize) -> Self {
        let pick = |signal: &[f64]| pick(signal, factor, 0);
        Signals {
            position: pick(&self.position),
            deformation: pick(&self.deformation),
            motor_speed: pick(&self.motor_speed),
            link_speed: pick(&self.link_speed),
            motor_acceleration: pick(&self.motor_acceleration),
            motor_torque: pick(&self.motor_torque),
            link_torque: pick(&self.link_torque),
        }
    }

    /// Regressor of both rows of a model.
    pub(super) fn regressor(&self, settings: &Settings, model: &RobotModel) -> RegressorBlock {
        let n = self.len();
        let mut q = self.position.clone();
        q.extend(self.position.iter().zip(&self.deformation).map(|(q, d)| settings.ratio * (q + d)));
        let dq = [self.link_speed.as_slice(), &self.motor_speed].concat();
        let ddq = [vec![0.0; n], self.motor_acceleration.clone()].concat();
        let mut out = RegressorBlock::new(model.layout().clone(), n);
        model.regressor(&MotionBlock::plain(n, &q, &dq, &ddq), &model.parameters().shape_start(), &mut out);
        out
    }
}
