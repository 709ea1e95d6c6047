//! One file per command.

pub(crate) mod backlash;
pub(crate) mod check;
pub(crate) mod clearance;
pub(crate) mod compare;
pub(crate) mod completions;
pub(crate) mod convert;
pub(crate) mod design;
pub(crate) mod diff;
pub(crate) mod explain;
pub(crate) mod export;
pub(crate) mod fleet;
pub(crate) mod friction;
pub(crate) mod gains;
pub(crate) mod identify;
pub(crate) mod init;
pub(crate) mod inspect;
pub(crate) mod man;
pub(crate) mod motion;
pub(crate) mod next;
pub(crate) mod online;
pub(crate) mod payload;
mod playback;
pub(crate) mod predict;
pub(crate) mod reduce;
pub(crate) mod regressor;
mod run;
pub(crate) mod schema;
pub(crate) mod servo;
pub(crate) mod simulate;
pub(crate) mod study;
mod table;
pub(crate) mod validate;

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig};
use dynid::estimate::{Estimate, ReadingRecord};
use dynid::io::columns::{FullSignal, PerJoint, SignalSpec};
use dynid::io::log::Missing;
use dynid::{Error, Robot, RobotOptions};
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs::Outputs;

use crate::args::{LogArgs, MissingArg, PrintArgs, ReadingArgs, RobotArgs};

fn load_robot(args: &RobotArgs) -> Result<Robot, Failure> {
    let options = RobotOptions {
        gravity: args.gravity,
        couple_mimics: args.couple_mimics,
        floating_base: args.floating_base,
        locked: args.lock.clone(),
    };
    Ok(Robot::load(&args.robot, &options)?)
}

/// Refuses JSON on a standard output that a file takes.
fn demand_stdout(print: PrintArgs, set: &Outputs) -> Result<(), Failure> {
    match print.json && set.take_stdout() {
        true => Err(Failure::Usage(
            "--json: standard output is taken by a file (`-`)".to_owned(),
            "give the file a name, or leave --json out",
        )),
        false => Ok(()),
    }
}

/// Prints a result; beside a file that takes standard output it is a note.
fn result(text: &str, taken: bool, notes: Notes) -> Result<(), Failure> {
    match taken {
        true => notes.tell(text.trim_end()),
        false => data(text)?,
    }
    Ok(())
}

/// Names of elements from the command line; `none` stands for an empty list.
fn element_names(names: Option<&[String]>) -> Option<Vec<String>> {
    names.map(|list| if list == ["none"] { Vec::new() } else { list.to_vec() })
}

/// Flags over the columns of a configuration: of the run, and of logs that state their own.
fn apply_log_args_to(config: &mut Config, args: &LogArgs) {
    let logs = config.log.iter_mut().chain(&mut config.validation);
    let own = logs.filter_map(|log| log.columns.as_mut());
    own.chain([&mut config.columns]).for_each(|spec| apply_log_args(spec, args));
}

fn apply_log_args(spec: &mut dynid::io::MappingSpec, args: &LogArgs) {
    if args.rate_hz.is_some() {
        (spec.rate_hz, spec.time) = (args.rate_hz, None);
    }
    if args.gains.is_some() {
        spec.current_gains.clone_from(&args.gains);
    }
    spec.allow_unlogged |= args.allow_unlogged;
    if args.names.is_some() {
        spec.names.clone_from(&args.names);
    }
    spec.missing = match args.missing {
        Some(MissingArg::Error) => Some(Missing::Error),
        Some(MissingArg::Drop) => Some(Missing::Drop),
        Some(MissingArg::Interpolate) => Some(Missing::Interpolate),
        None => spec.missing,
    };
}

/// How logs are to be read: columns and side of the gear by a configuration, else as the estimate records; flags over both.
struct Reading {
    columns: dynid::io::MappingSpec,
    motor_side: Option<dynid::config::MotorSide>,
    /// Training logs of the configuration.
    stated: Vec<LogConfig>,
    rows: Option<(usize, usize)>,
    /// The estimate that stated the columns.
    recorded: Option<PathBuf>,
}

impl Reading {
    fn of(args: &ReadingArgs, estimate: &Estimate, file: &Path) -> Result<Self, Failure> {
        Self::recorded(args, estimate.provenance.reading.as_ref(), file)
    }

    /// `recorded`: how the logs behind `file` were read.
    fn recorded(args: &ReadingArgs, recorded: Option<&ReadingRecord>, file: &Path) -> Result<Self, Failure> {
        let rows = args.rows;
        let mut reading = match (args.config.as_deref().map(Config::read).transpose()?, recorded) {
            (Some(config), _) => {
                let stated = config.training_logs();
                Self { columns: config.columns, motor_side: config.motor_side, stated, rows, recorded: None }
            }
            (None, recorded) => {
                let ReadingRecord { columns, motor_side, .. } = recorded.cloned().unwrap_or_default();
                let stated = recorded.is_some_and(ReadingRecord::states_columns);
                let recorded = stated.then(|| file.to_owned());
                Self { columns, motor_side, stated: Vec::new(), rows, recorded }
            }
        };
        apply_log_args(&mut reading.columns, &args.columns);
        // Recorded effort columns keep their names, and take the gains that are given for their scale.
        if reading.recorded.is_some()
            && let Some(effort) = &mut reading.columns.effort
            && let Some(gains) = reading.columns.current_gains.take()
        {
            let scale = Some(PerJoint::List(gains));
            *effort = SignalSpec::Full(match effort.clone() {
                SignalSpec::Full(full) => FullSignal { scale, ..full },
                SignalSpec::Names(columns) => FullSignal { columns, unit: None, scale, offset: None },
            });
        }
        Ok(reading)
    }

    /// Says where columns that do not fit come from.
    fn named(&self, error: Error) -> Error {
        match (error, &self.recorded) {
            (Error::Columns { file, source }, Some(estimate)) => {
                Error::RecordedColumns { file, estimate: estimate.display().to_string(), source }
            }
            (other, _) => other,
        }
    }

    fn log(&self, path: &Path) -> LogConfig {
        LogConfig { path: path.to_owned(), rows: self.rows, ..LogConfig::default() }
    }
}
