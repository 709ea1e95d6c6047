//! From a configuration and its files to an identified model: the main job.

use dynid_io::{MappingSpec, TrajectoryFile};

use crate::Error;
use crate::config::{Config, LogConfig};
use crate::estimate::{InputKind, InputRecord, ReadingRecord};
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
    let robot = config.read_robot()?;
    let trajectory = config.instruments.as_ref().and_then(|table| table.trajectory.as_deref());
    let trajectory = trajectory.map(TrajectoryFile::read_source).transpose()?;
    let logs = config.read_all(&robot, progress)?;
    let found = pipeline::identify(&robot, logs, &config.settings()?, progress)?;
    let mut inputs = found.inputs();
    inputs.extend(trajectory.map(|(_, source)| InputRecord::of(InputKind::Trajectory, &source)));
    let exported = exported(&found)?;
    let reading = config.reading(&found);
    Ok(Run { identification: found, config: config.clone(), inputs, reading, exported })
}

impl Config {
    /// Reads the robot and the logs of a configuration, examines them, prepares them for a model with the elements asked for.
    ///
    /// # Errors
    /// Fails as [`identify`] does.
    pub(crate) fn open(&self, progress: &mut dyn FnMut(Step)) -> Result<Opened, Error> {
        self.check()?;
        self.demand_inputs()?;
        progress(Step::Read(self.robot.display().to_string()));
        let robot = self.read_robot()?;
        let logs = self.read_all(&robot, progress)?;
        pipeline::open(robot, logs, &self.settings()?, progress)
    }

    /// The robot of a configuration.
    ///
    /// # Errors
    /// Fails as [`Robot::load`] does.
    pub(crate) fn read_robot(&self) -> Result<Robot, Error> {
        let options = RobotOptions {
            gravity: self.gravity,
            couple_mimics: self.couple_mimics.unwrap_or(false),
            floating_base: false,
            locked: self.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
        };
        Ok(Robot::load(&self.robot, &options)?.with_registry(self.registry.clone()))
    }

    /// Reads the training logs of a configuration.
    ///
    /// # Errors
    /// Fails as [`logs::load`] does.
    pub(crate) fn read_training(
        &self,
        robot: &Robot,
        progress: &mut dyn FnMut(Step),
    ) -> Result<Vec<Log>, Error> {
        let mut files = self.training_logs();
        if let Some(table) = &self.instruments {
            table.read_reference(&mut files, &self.columns, &names(&robot.axes))?;
        }
        let read = |file: &LogConfig| {
            progress(Step::Read(file.path.display().to_string()));
            let mut log = logs::load(file, &robot.axes, &self.columns, self.motor_side.as_ref())?;
            log.reference = logs::reference(self.instruments.as_ref(), file)?;
            log.source.rate_given = self.columns.rate_hz.is_some();
            log.source.columns_given = self.columns != MappingSpec::default();
            Ok(log)
        };
        files.iter().map(read).collect()
    }

    /// Reads training and validation logs.
    fn read_all(&self, robot: &Robot, progress: &mut dyn FnMut(Step)) -> Result<Vec<Log>, Error> {
        let mut out = self.read_training(robot, progress)?;
        // Joints that no training log holds are not looked for in others.
        let held = pipeline::held_where_not_logged(robot.clone(), &out)?;
        for file in &self.validation {
            progress(Step::Read(file.path.display().to_string()));
            let mut log = logs::load(file, &held.axes, &self.columns, self.motor_side.as_ref())?;
            log.settings.validation = true;
            out.push(log);
        }
        Ok(out)
    }

    /// How the training logs were read.
    fn reading(&self, found: &Identification) -> ReadingRecord {
        let sources = &found.sources[..found.logs.len()];
        let stated = |log: &LogConfig| log.columns.clone().unwrap_or_else(|| self.columns.clone());
        let mut own = self.log.iter().zip(sources).map(|(log, source)| match &source.mapping {
            // What was read of motors, on the side of the joints.
            Some(mapping) if found.taken_as_stiff => MappingSpec::from(mapping).read_as(&stated(log)),
            _ => stated(log),
        });
        let columns = match own.next() {
            Some(first) if own.all(|other| other == first) => first,
            _ => self.columns.clone(),
        };
        ReadingRecord {
            columns,
            motor_side: self.motor_side.clone(),
            understood: sources.iter().map(|source| source.columns.clone()).collect(),
        }
    }
}
