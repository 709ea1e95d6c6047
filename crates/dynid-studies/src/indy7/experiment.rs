//! Virtual experiments on the arm.

use std::f64::consts::PI;

use dynid::estimators::conditioning::{ConditioningSettings, PreparedLog, prepare};
use dynid::model::EffortModel;
use dynid::model::element::temperature_channel;
use dynid::motion::trajectory::{Form, FourierTrajectory, Point, RowOrder, Trajectory};
use dynid::motion::{Channel, JointSignals, Log};
use dynid::sim::{ControlSettings, ExperimentSettings, Imperfections, Profile, Ripple, run};

use super::JOINTS;
use super::robot::Indy7;
use super::settings::Settings;
use crate::StudyError;

/// Base frequency of the paper's trajectories, rad/s.
pub(super) const BASE: f64 = 0.1 * PI;

/// A periodic trajectory from rows of the paper's form.
pub(super) fn trajectory(rows: &[Vec<f64>]) -> Result<FourierTrajectory, StudyError> {
    repeated(rows, 1)
}

/// A motion several times over.
pub(super) fn repeated(rows: &[Vec<f64>], periods: usize) -> Result<FourierTrajectory, StudyError> {
    Ok(FourierTrajectory::from_rows(BASE, Form::VelocityAmplitudes, &RowOrder::default(), rows, periods)?)
}

/// What is to be run.
pub(super) struct Experiment<'a> {
    pub(super) trajectory: &'a dyn Trajectory,
    /// Temperature of every joint over time.
    pub(super) temperature: Profile,
    /// Torque ripple that no model knows of.
    pub(super) ripple: bool,
    pub(super) rate_hz: f64,
    pub(super) seed: u64,
}

/// One temperature throughout.
pub(super) fn constant(temperature: f64) -> Result<Profile, StudyError> {
    Ok(Profile::new(vec![(0.0, temperature)])?)
}

impl Experiment<'_> {
    /// Lets the arm follow the trajectory in closed loop and gives the log.
    pub(super) fn log(&self, name: &str, arm: &Indy7, settings: &Settings) -> Result<Log, StudyError> {
        let simulation = &settings.simulation;
        let ripple = (0..JOINTS).map(|j| Ripple {
            // The drive delivers what the logged torque lacks.
            amplitude: if self.ripple { -simulation.ripple[j] } else { 0.0 },
            cycles: 2.0,
            phase: j as f64,
        });
        let experiment = ExperimentSettings {
            duration_s: self.trajectory.duration(),
            log_rate_hz: self.rate_hz,
            tolerance: 1e-6,
            control: ControlSettings { rate_hz: self.rate_hz, ..ControlSettings::default() },
            imperfections: Imperfections {
                encoder_bits: simulation.encoder_bits,
                velocity_noise: simulation.velocity_noise,
                effort_noise: simulation.torque_noise.to_vec(),
                ripple: Some(ripple.collect()),
                ..Imperfections::none()
            },
            channels: vec![self.temperature.clone(); arm.model.channels().len()],
            seed: self.seed,
        };
        let reference = |time: f64| {
            let mut points = vec![Point::default(); JOINTS];
            self.trajectory.at(time, &mut points);
            points.iter().map(|p| [p.position, p.velocity, p.acceleration]).collect()
        };
        let result = run(&mut arm.plant()?, &arm.plant()?, &reference, &experiment)?.log;
        let names = arm.mechanism.rate_names();
        let joints = names.iter().zip(result.position).zip(result.velocity).zip(result.effort);
        let joints = joints.map(|(((name, position), velocity), effort)| JointSignals {
            name: name.clone(),
            position,
            velocity: Some(velocity),
            effort,
        });
        let channels = arm.model.channels().iter().zip(result.channels);
        let channels = channels.map(|(name, values)| Channel { name: name.clone(), values });
        debug_assert!(names.iter().all(|j| arm.model.channels().contains(&temperature_channel(j))));
        Ok(Log::new(name, result.time, joints.collect(), channels.collect()).map_err(dynid::Error::from)?)
    }

    /// The log, made ready for rows.
    pub(super) fn prepared(
        &self,
        name: &str,
        arm: &Indy7,
        settings: &Settings,
    ) -> Result<PreparedLog, StudyError> {
        let log = self.log(name, arm, settings)?;
        let conditioning = ConditioningSettings::default();
        Ok(prepare(&log, arm.model.as_ref(), &conditioning).map_err(dynid::Error::from)?)
    }
}
