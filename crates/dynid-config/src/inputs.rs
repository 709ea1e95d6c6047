//! Robot and logs that a configuration names.

use dynid_identify::Error;
use dynid_identify::estimate::ReadingRecord;
use dynid_identify::log::{Log, names};
use dynid_identify::pipeline::{self, Identification, Opened, Step};
use dynid_identify::robot::{Robot, RobotOptions};
use dynid_logs::MappingSpec;

use crate::config::{Config, LogConfig};
use crate::logs;

impl Config {
    /// Reads the robot and the logs of a configuration, examines them, prepares them for a model with the elements asked for.
    ///
    /// # Errors
    /// Fails as [`Config::read_robot`], [`Config::read_training`] and [`pipeline::open`] do.
    pub fn open(&self, progress: &mut dyn FnMut(Step)) -> Result<Opened, Error> {
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
    pub fn read_robot(&self) -> Result<Robot, Error> {
        let options = RobotOptions {
            gravity: self.gravity,
            couple_mimics: self.couple_mimics.unwrap_or(false),
            floating_base: false,
            locked: self.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
        };
        let robot = Robot::load(&self.robot, &options)?;
        let registry = robot.elements.registry.clone().and(&self.registry);
        Ok(robot.with_registry(registry))
    }

    /// Reads the training logs of a configuration.
    ///
    /// # Errors
    /// Fails as [`logs::load`] does.
    pub fn read_training(&self, robot: &Robot, progress: &mut dyn FnMut(Step)) -> Result<Vec<Log>, Error> {
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
    ///
    /// # Errors
    /// Fails as [`logs::load`] does.
    pub fn read_all(&self, robot: &Robot, progress: &mut dyn FnMut(Step)) -> Result<Vec<Log>, Error> {
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
    pub fn reading(&self, found: &Identification) -> ReadingRecord {
        let sources = &found.sources[..found.logs.len()];
        let stated = |log: &LogConfig| log.columns.clone().unwrap_or_else(|| self.columns.clone());
        let mut own = self.log.iter().zip(sources).map(|(log, source)| match &source.mapping {
            // What was read of motors, on the side of the joints; who asked for that goes on reading both sides.
            Some(mapping) if !found.stiff_joints.is_empty() && !found.settings.stiff_joints => {
                MappingSpec::from(mapping).read_as(&stated(log))
            }
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
