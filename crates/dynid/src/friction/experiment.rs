//! From logs to points of steady friction.

use dynid_friction::steady_friction::SteadyPoint;
use dynid_model::element::temperature_channel;
use dynid_motion::clock::{ClockSettings, UniformLog, uniform};
use dynid_motion::constant_speed::{Pairing, Pass, Segment, at_rest, pair, segments, speed};

use super::config::{FrictionConfig, FrictionLog, LoggedSignal, ThermalLines};
use crate::Error;
use crate::estimate::InputRecord;
use crate::friction_model::FrictionError;
use crate::log::Log;
use crate::robot::Robot;

/// Samples of one pass at constant speed.
#[derive(Debug, Clone, PartialEq)]
pub struct PassSamples {
    /// Log file.
    pub log: String,
    /// Signed speed, rad/s or m/s.
    pub speed: f64,
    /// Duration, s.
    pub duration: f64,
    position: Vec<f64>,
    effort: Vec<f64>,
    temperature: Option<Vec<f64>>,
}

/// What the logs say about one joint.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct JointExperiment {
    /// Joint.
    pub joint: String,
    /// Passes at constant speed.
    pub passes: Vec<PassSamples>,
    /// Forward and backward together.
    pub pairing: Pairing,
    /// Samples of friction signals, in order of time, logs one after the other.
    pub series: Vec<SteadyPoint>,
    /// What to know about it.
    pub notes: Vec<String>,
}

impl JointExperiment {
    /// Points to be fitted: those of pairs, else those of friction signals.
    pub fn points(&self) -> Vec<SteadyPoint> {
        if self.pairing.points.is_empty() {
            return self.series.clone();
        }
        self.pairing
            .points
            .iter()
            .map(|p| SteadyPoint {
                speed: p.speed,
                temperature: p.temperature,
                friction: p.friction,
                std: p.std,
            })
            .collect()
    }

    /// Whether the points are samples of a signal.
    pub fn is_series(&self) -> bool {
        self.pairing.points.is_empty() && !self.series.is_empty()
    }
}

/// Joints whose motion and effort logs hold.
pub(super) fn driven(robot: &Robot) -> Vec<String> {
    let all = robot.mechanism.rate_names();
    let drive = |name: &String| all.iter().position(|n| n == name).is_some_and(|rate| robot.is_driven(rate));
    robot.axes.iter().map(|axis| axis.name.clone()).filter(drive).collect()
}

/// What half the difference of both directions holds beside the friction of the joint itself, and at which loads.
fn paths(robot: &Robot, joint: &str) -> Vec<String> {
    let follows = robot.elements.reactions.iter().any(|r| r.joint == joint);
    let loads =
        "friction follows loads here (`reaction_friction`): the law holds at the loads of this test alone";
    let passive = "the joint is in a loop: the drive also turns passive joints, and their friction, at the poses of this test, is in these \
                   numbers; beside friction elements of passive joints it would count twice";
    let notes = [(follows, loads), (robot.closed.is_some(), passive)];
    notes.into_iter().filter(|(applies, _)| *applies).map(|(_, note)| note.to_owned()).collect()
}

/// Takes all logs of steady tests, one after the other. Joints come in the robot's order, those without a pass or signal left out.
pub(super) fn read(
    config: &FrictionConfig,
    robot: &Robot,
    (warnings, inputs): (&mut Vec<String>, &mut Vec<InputRecord>),
    load: &mut dyn FnMut(&FrictionLog) -> Result<Log, Error>,
) -> Result<Vec<JointExperiment>, Error> {
    let names = driven(robot);
    let mut first = None;
    let of = |joint: &String| JointExperiment {
        joint: joint.clone(),
        notes: paths(robot, joint),
        ..JointExperiment::default()
    };
    let mut joints: Vec<JointExperiment> = names.iter().map(of).collect();
    for log in &config.log {
        let loaded = load(log)?;
        first.get_or_insert_with(|| (loaded.log.name().to_owned(), log.joint.clone()));
        inputs.extend(loaded.source.inputs.iter().cloned());
        warnings.extend(crate::log::temperature_warnings(&loaded.log));
        match log.signal {
            LoggedSignal::Effort => passes(config, log, &loaded, &mut joints, warnings)?,
            LoggedSignal::Friction => series(config, log, &loaded, &mut joints)?,
        }
    }
    for joint in &mut joints {
        let passes: Vec<Pass<'_>> = joint
            .passes
            .iter()
            .map(|p| Pass {
                speed: p.speed,
                position: &p.position,
                effort: &p.effort,
                temperature: p.temperature.as_deref(),
            })
            .collect();
        joint.pairing = pair(&passes, &config.pairing()).map_err(FrictionError::from)?;
    }
    joints.retain(|j| !j.passes.is_empty() || !j.series.is_empty());
    if joints.is_empty() {
        let (file, joint) = first.unwrap_or_default();
        return Err(FrictionError::NoConstantSpeed {
            file,
            logs: config.log.len(),
            joint,
            least_duration_s: config.constant_speed.least_duration_s,
        }
        .into());
    }
    Ok(joints)
}

pub(super) fn on_grid(loaded: &Log) -> Result<UniformLog, Error> {
    let settings = ClockSettings::default();
    Ok(uniform(&loaded.log, &settings)
        .map_err(|e| FrictionError::Clock { file: loaded.log.name().to_owned(), source: e })?)
}

/// Temperatures of a joint.
pub(super) fn temperature<'a>(joint: &str, channels: &'a [dynid_motion::Channel]) -> Option<&'a [f64]> {
    let name = temperature_channel(joint);
    channels.iter().find(|c| c.name == name).map(|c| c.values.as_slice())
}

fn missing_temperature(config: &FrictionConfig, file: &str, joint: &str) -> Result<(), Error> {
    match config.thermal_lines {
        ThermalLines::Required => {
            Err(FrictionError::NoTemperature { file: file.to_owned(), joint: joint.to_owned() }.into())
        }
        _ => Ok(()),
    }
}

fn passes(
    config: &FrictionConfig,
    log: &FrictionLog,
    loaded: &Log,
    joints: &mut [JointExperiment],
    warnings: &mut Vec<String>,
) -> Result<(), Error> {
    let file = loaded.log.name().to_owned();
    let grid = on_grid(loaded)?;
    let time: Vec<f64> = (0..grid.samples()).map(|k| grid.time(k)).collect();
    let mut found = 0;
    for (k, signals) in grid.joints.iter().enumerate() {
        let asked = log.joint.as_ref().map(|j| *j == signals.name);
        if asked == Some(false) || (asked.is_none() && !signals.moves()) {
            continue;
        }
        let all = segments(&time, signals, &config.segments()).map_err(FrictionError::from)?;
        let others = grid.joints.iter().enumerate().filter(|(j, _)| *j != k);
        let rests = |s: &Segment| {
            others.clone().all(|(_, o)| at_rest(o, s.rows.clone(), config.constant_speed.rest_tolerance))
        };
        let (alone, together): (Vec<Segment>, Vec<Segment>) = all.into_iter().partition(rests);
        if !together.is_empty() && (alone.is_empty() || asked == Some(true)) {
            warnings.push(format!(
                "{file}: joint `{}`: {} of {} stretches of constant speed left out, since other joints move meanwhile",
                signals.name,
                together.len(),
                together.len() + alone.len()
            ));
        }
        let Some(joint) = joints.iter_mut().find(|j| j.joint == signals.name) else { continue };
        let warmth = temperature(&signals.name, &grid.channels);
        if warmth.is_none() && !alone.is_empty() {
            missing_temperature(config, &file, &signals.name)?;
        }
        found += alone.len();
        for segment in alone {
            let rows: Vec<usize> = segment.rows.clone().filter(|r| grid.usable[*r]).collect();
            let take = |x: &[f64]| rows.iter().map(|r| x[*r]).collect::<Vec<f64>>();
            joint.passes.push(PassSamples {
                log: file.clone(),
                speed: segment.speed,
                duration: segment.duration,
                position: take(&signals.position),
                effort: take(&signals.effort),
                temperature: warmth.map(take),
            });
        }
    }
    if found == 0 && config.log.len() > 1 {
        warnings.push(format!("{file}: no stretch of constant speed"));
    }
    Ok(())
}

fn series(
    config: &FrictionConfig,
    log: &FrictionLog,
    loaded: &Log,
    joints: &mut [JointExperiment],
) -> Result<(), Error> {
    let file = loaded.log.name().to_owned();
    for signals in loaded.log.joints() {
        let asked = log.joint.as_ref().map(|j| *j == signals.name);
        if asked == Some(false) || (asked.is_none() && !signals.moves()) {
            continue;
        }
        let Some(joint) = joints.iter_mut().find(|j| j.joint == signals.name) else { continue };
        let c = &config.constant_speed;
        let speeds =
            speed(loaded.log.time(), signals, c.window_s, c.use_velocity).map_err(FrictionError::from)?;
        let warmth = temperature(&signals.name, loaded.log.channels());
        if warmth.is_none() {
            missing_temperature(config, &file, &signals.name)?;
        }
        joint.series.extend(speeds.iter().zip(&signals.effort).enumerate().map(|(k, (speed, friction))| {
            SteadyPoint { speed: *speed, temperature: warmth.map(|t| t[k]), friction: *friction, std: 1.0 }
        }));
    }
    Ok(())
}
