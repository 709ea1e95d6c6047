//! From a configuration and its files to an identified model: the main job.

use dynid_io::{MappingSpec, TrajectoryFile};

use crate::Error;
use crate::config::{Config, LogConfig};
use crate::estimate::{InputRecord, ReadingRecord};
use crate::export::exported;
use crate::log::{Log, names};
use crate::logs;
use crate::pipeline::{self, Identification, Opened, Step};
use crate::robot::{Robot, RobotOptions};
use crate::run::Run;

/// Reads robot and logs, conditions, fits, validates.
///
/// # Errors
/// [`Error`]: bad input. A rank-deficient log is a status of the result, not an error.
pub fn identify(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<Run, Error> {
    config.demand_inputs()?;
    config.check_effect()?;
    config.check()?;
    progress(Step::Read(config.robot.display().to_string()));
    let robot = load_robot(config)?;
    let trajectory = config.instruments.as_ref().and_then(|table| table.trajectory.as_deref());
    let trajectory = trajectory.map(TrajectoryFile::read_source).transpose()?;
    let logs = read_all(config, &robot, progress)?;
    let found = pipeline::identify(&robot, logs, &config.settings()?, progress)?;
    let mut inputs = found.inputs();
    inputs.extend(trajectory.map(|(_, source)| InputRecord::of("trajectory", &source)));
    let exported = exported(&found)?;
    let reading = reading(config, &found);
    Ok(Run { identification: found, config: config.clone(), inputs, reading, exported })
}

/// Reads the robot and the logs of a configuration, examines them, prepares them for a model with the elements asked for.
///
/// # Errors
/// Fails as [`identify`] does.
pub(crate) fn open(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<Opened, Error> {
    config.check()?;
    config.demand_inputs()?;
    progress(Step::Read(config.robot.display().to_string()));
    let robot = load_robot(config)?;
    let logs = read_all(config, &robot, progress)?;
    pipeline::open(robot, logs, &config.settings()?, progress)
}

/// The robot of a configuration.
///
/// # Errors
/// Fails as [`Robot::load`] does.
pub(crate) fn load_robot(config: &Config) -> Result<Robot, Error> {
    let options = RobotOptions {
        gravity: config.gravity,
        couple_mimics: config.couple_mimics.unwrap_or(false),
        floating_base: false,
        locked: config.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
    };
    Ok(Robot::load(&config.robot, &options)?.with_registry(config.registry.clone()))
}

/// Reads the training logs of a configuration.
///
/// # Errors
/// Fails as [`logs::load`] does.
pub(crate) fn read_training(
    config: &Config,
    robot: &Robot,
    progress: &mut dyn FnMut(Step),
) -> Result<Vec<Log>, Error> {
    let mut files = config.training_logs();
    if let Some(table) = &config.instruments {
        table.read_reference(&mut files, &config.columns, &names(&robot.axes))?;
    }
    let read = |file: &LogConfig| {
        progress(Step::Read(file.path.display().to_string()));
        let mut log = logs::load(file, &robot.axes, &config.columns, config.motor_side.as_ref())?;
        log.reference = logs::reference(config, file)?;
        log.source.rate_given = config.columns.rate_hz.is_some();
        log.source.columns_given = config.columns != MappingSpec::default();
        Ok(log)
    };
    files.iter().map(read).collect()
}

/// Reads training and validation logs.
fn read_all(config: &Config, robot: &Robot, progress: &mut dyn FnMut(Step)) -> Result<Vec<Log>, Error> {
    let mut out = read_training(config, robot, progress)?;
    // Joints that no training log holds are not looked for in others.
    let held = pipeline::held_where_not_logged(robot.clone(), &out)?;
    for file in &config.validation {
        progress(Step::Read(file.path.display().to_string()));
        let mut log = logs::load(file, &held.axes, &config.columns, config.motor_side.as_ref())?;
        log.settings.validation = true;
        out.push(log);
    }
    Ok(out)
}

/// How the training logs were read.
fn reading(config: &Config, found: &Identification) -> ReadingRecord {
    let sources = &found.sources[..found.logs.len()];
    let stated = |log: &LogConfig| log.columns.clone().unwrap_or_else(|| config.columns.clone());
    let mut own = config.log.iter().zip(sources).map(|(log, source)| match &source.mapping {
        // What was read of motors, on the side of the joints.
        Some(mapping) if found.taken_as_stiff => MappingSpec::from(mapping).read_as(&stated(log)),
        _ => stated(log),
    });
    let columns = match own.next() {
        Some(first) if own.all(|other| other == first) => first,
        _ => config.columns.clone(),
    };
    ReadingRecord {
        columns,
        motor_side: config.motor_side.clone(),
        understood: sources.iter().map(|source| source.columns.clone()).collect(),
    }
}
