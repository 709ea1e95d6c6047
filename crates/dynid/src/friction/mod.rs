//! Friction experiments: constant-speed tests and pre-sliding motion of single joints.
//!
//! From logs in which one joint at a time runs at constant speeds forth and back, [`identify_friction`] finds
//!
//! - friction by speed and temperature, half the difference of both directions at equal position (gravity and offset
//!   cancel): [`dynid_motion::constant_speed`];
//! - the friction law that these points can carry, with straight lines of its viscous coefficients over temperature:
//!   [`dynid_friction::steady_friction`];
//! - stiffness and damping of LuGre's bristles from pre-sliding logs, by simulation error: [`dynid_sim::presliding`].
//!
//! [`FrictionModel`] is what it leaves behind, `friction.json`. What the logs cannot tell is said, not guessed: with one
//! direction alone Coulomb friction and offset are the same column.

pub mod config;
mod experiment;
mod presliding;
mod record;
mod report;

pub use crate::friction_model::{self as model, FrictionError, FrictionModel, known_friction};
pub use crate::known_friction::KnownFriction;
pub use config::{
    BristlePrior, ConstantSpeedConfig, FrictionConfig, FrictionLog, HoldName, LawName, LoggedSignal,
    PairsConfig, PreslidingLog, ThermalLines,
};
pub use experiment::{JointExperiment, PassSamples};
pub use presliding::{PreslidingFit, PreslidingTest, fit_presliding};

use dynid_friction::steady_friction::{SteadyError, SteadyFriction, analyse};

use crate::estimate::InputRecord;
use crate::log::Log;
use crate::robot::{Robot, RobotOptions, refuse_elastic};
use crate::{Error, logs};

/// What is being worked on.
#[derive(Debug, Clone, PartialEq)]
pub enum FrictionStep {
    /// Reading a log.
    Read(String),
    /// Fitting the law of a joint.
    Law(String),
    /// Searching the bristles of a joint.
    Presliding(String),
}

/// One joint with everything that was found.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifiedJoint {
    /// What the logs say.
    pub experiment: JointExperiment,
    /// The law, or why there is none.
    pub law: Result<SteadyFriction, String>,
    /// Pre-sliding logs.
    pub presliding: Vec<PreslidingFit>,
}

/// Friction of a robot with everything that was found on the way.
#[derive(Debug)]
pub struct FrictionIdentification {
    /// The robot.
    pub robot: Robot,
    /// Joints with tests, in the robot's order.
    pub joints: Vec<IdentifiedJoint>,
    /// Warnings, in words.
    pub warnings: Vec<String>,
    /// Files as they were read.
    pub inputs: Vec<InputRecord>,
}

/// An entry of the configuration whose log is wanted.
#[derive(Debug, Clone, Copy)]
enum Entry<'a> {
    Steady(&'a FrictionLog),
    Presliding(&'a PreslidingLog),
}

/// Gives the log of an entry; entries are asked for in their order.
type Load<'a> = dyn FnMut(Entry<'_>, &mut dyn FnMut(FrictionStep)) -> Result<Log, Error> + 'a;

/// Reads robot and logs, finds points, laws and bristles.
///
/// # Errors
/// As [`friction_of_logs`], and for files that cannot be read.
pub fn identify_friction(
    config: &FrictionConfig,
    progress: &mut dyn FnMut(FrictionStep),
) -> Result<FrictionIdentification, Error> {
    config.check()?;
    let robot = Robot::load(&config.robot, &RobotOptions::default())?;
    let axes = robot.axes.clone();
    let mut load = |entry: Entry<'_>, progress: &mut dyn FnMut(FrictionStep)| {
        let file = match entry {
            Entry::Steady(log) => {
                progress(FrictionStep::Read(log.path.display().to_string()));
                log.plain()
            }
            Entry::Presliding(log) => log.plain(),
        };
        logs::load(&file, &axes, &config.columns, None)
    };
    of_entries(robot, config, &mut load, progress)
}

/// Finds points, laws and bristles from logs that need not come from files. `steady` and `presliding`: those of `log` and `presliding` of the
/// configuration, in their order; its paths, rows and columns count for nothing here.
///
/// # Errors
/// [`Error`]: bad input, among it another number of logs than of entries, no stretch of constant speed in any log, and thermal lines that are
/// required but impossible. One direction only, too few speeds and coarse encoders are results that say so.
pub fn friction_of_logs(
    robot: Robot,
    steady: Vec<Log>,
    presliding: Vec<Log>,
    config: &FrictionConfig,
    progress: &mut dyn FnMut(FrictionStep),
) -> Result<FrictionIdentification, Error> {
    config.check()?;
    if steady.is_empty() {
        return Err(Error::setting("log", "at least one log of a friction test", 0));
    }
    for (name, entries, logs) in
        [("log", config.log.len(), steady.len()), ("presliding", config.presliding.len(), presliding.len())]
    {
        if entries != logs {
            return Err(Error::setting(name, &format!("an entry for each of {logs} logs"), entries));
        }
    }
    let (mut steady, mut presliding) = (steady.into_iter(), presliding.into_iter());
    let mut load = |entry: Entry<'_>, _: &mut dyn FnMut(FrictionStep)| {
        let next = match entry {
            Entry::Steady(_) => steady.next(),
            Entry::Presliding(_) => presliding.next(),
        };
        Ok(next.unwrap_or_else(|| unreachable!("as many logs as entries, each asked for once")))
    };
    of_entries(robot, config, &mut load, progress)
}

fn of_entries(
    robot: Robot,
    config: &FrictionConfig,
    load: &mut Load<'_>,
    progress: &mut dyn FnMut(FrictionStep),
) -> Result<FrictionIdentification, Error> {
    refuse_elastic(&robot, "evaluated by friction experiments")?;
    // What a robot file leaves open about bodies is no matter for friction.
    let mut warnings = Vec::new();
    let mut inputs = robot.inputs();
    let known = experiment::driven(&robot);
    let named = config.prior.keys().chain(config.presliding.iter().map(|log| &log.joint));
    if let Some(name) =
        named.chain(config.log.iter().filter_map(|log| log.joint.as_ref())).find(|j| !known.contains(j))
    {
        return Err(Error::UnknownJoint { name: name.clone(), known });
    }
    let experiments = experiment::read(config, &robot, (&mut warnings, &mut inputs), &mut |log| {
        load(Entry::Steady(log), progress)
    })?;
    let mut joints = Vec::with_capacity(experiments.len());
    for experiment in experiments {
        progress(FrictionStep::Law(experiment.joint.clone()));
        let law = law(config, &experiment)?;
        joints.push(IdentifiedJoint { experiment, law, presliding: Vec::new() });
    }
    for log in &config.presliding {
        progress(FrictionStep::Presliding(log.joint.clone()));
        let joint = joints.iter_mut().find(|j| j.experiment.joint == log.joint);
        let law = joint.as_ref().and_then(|j| j.law.as_ref().ok()).map(|l| &l.law);
        let loaded = load(Entry::Presliding(log), progress)?;
        let fit = presliding::find(config, log, &loaded, law, (&mut warnings, &mut inputs))?;
        if let Some(joint) = joint {
            joint.presliding.push(fit);
        }
    }
    Ok(FrictionIdentification { robot, joints, warnings, inputs })
}

/// The law of one joint; `Err` inside: there is none, and why.
fn law(
    config: &FrictionConfig,
    experiment: &JointExperiment,
) -> Result<Result<SteadyFriction, String>, Error> {
    let joint = || experiment.joint.clone();
    if experiment.pairing.one_direction() {
        let reason = "all passes run in one direction: Coulomb friction and offset or gravity cannot be told apart, \
                      record the same speeds in the other direction";
        return Ok(Err(reason.to_owned()));
    }
    let points = experiment.points();
    if points.is_empty() {
        return Ok(Err("no two passes of both directions share speed, temperature and positions".to_owned()));
    }
    let steady = config.steady(experiment.is_series());
    let found = match analyse(&points, &steady) {
        Ok(found) => found,
        Err(source @ SteadyError::TooFew { .. }) => return Ok(Err(source.to_string())),
        Err(source @ SteadyError::Unsupported(_)) if steady.form.is_none() => {
            return Ok(Err(source.to_string()));
        }
        Err(source) => return Err(FrictionError::Law { joint: joint(), source }.into()),
    };
    if config.thermal_lines == ThermalLines::Required && !found.law.form.thermal {
        let reason = found.notes.first().cloned().unwrap_or_else(|| format!("the law is {}", found.law.form));
        return Err(FrictionError::NoLines { joint: joint(), reason }.into());
    }
    Ok(Ok(found))
}
