//! Logs as an identification takes them: signals by name in SI units, and what has to be known beside them.

use std::path::Path;

use dynid_logs::columns::EffortColumn;
use dynid_logs::{ColumnMapping, ReadingNote, Signals, TrajectoryFile};
use dynid_model::element::{is_temperature, temperature_channel};
use dynid_model::{EffortModel, RobotModel};
use dynid_motion::signal::largest;
use dynid_motion::temperature::{self, TemperatureDoubt};
use dynid_motion::{Channel, JointSignals, Portion};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, prepare};

use crate::Error;
use crate::input_record::InputRecord;
pub use crate::log_axis::{LogAxis, as_logged, axes, names};
use crate::per_joint::PerJoint;
use crate::robot::Robot;
use crate::settings::LogSettings;

pub mod poses;
mod probes;
pub mod turns;

/// A log of a robot: signals in SI units (rad, m, N m, N, °C) by joint, and what an identification has to know beside them.
///
/// [`Log::new`] takes arrays; a program that reads files fills the rest.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct Log {
    /// Signals.
    pub log: dynid_motion::Log,
    /// Name, payload, what the log has of its own, period.
    pub settings: LogSettings,
    /// What the controller wanted where a trajectory file says so; channels `reference_<joint>` come first.
    pub reference: Option<LogReference>,
    /// Positions that jumped by full turns and were unwrapped.
    pub unwrapped: Vec<turns::Unwrapped>,
    /// Where the log comes from.
    pub source: LogSource,
}

/// Where a log comes from: empty for arrays.
#[derive(Debug, Clone, Default)]
pub struct LogSource {
    /// How columns were understood: signal, column names.
    pub columns: Vec<(String, String)>,
    /// Columns of every signal with their factors.
    pub mapping: Option<ColumnMapping>,
    /// Whether joints were told by the numbers of columns alone, which another order would not show.
    pub by_number: bool,
    /// Whether positions and efforts were those of motors before a transmission matrix took them to the joints.
    pub on_motors: bool,
    /// Per row of the log: its data row in the file, from 1; empty: rows as they are.
    pub rows: Vec<usize>,
    /// Channels that the columns state, each of which wants a reader.
    pub stated_channels: Vec<String>,
    /// Whether the sample rate was stated.
    pub rate_given: bool,
    /// Whether columns were stated, not left to their names.
    pub columns_given: bool,
    /// Files that were read: the log, and its trajectory.
    pub inputs: Vec<InputRecord>,
    /// How the file was read where that was found out: format, decimal mark, unit of the time, rows without a value.
    pub notes: Vec<ReadingNote>,
}

/// A trajectory file as the reference of a log.
#[derive(Debug, Clone)]
pub struct LogReference {
    /// The file.
    pub trajectory: TrajectoryFile,
    /// Its name, for messages.
    pub file: String,
    /// Whether the log begins with the record behind the approach; else with the first point of the file.
    pub cut: bool,
    /// Whether the log is a part of a record, so that it is not known where in the trajectory it begins.
    pub part: bool,
}

impl Log {
    /// The same log with other signals, and whatever their making failed with.
    ///
    /// # Errors
    /// Those of `change`.
    pub fn map_signals<E>(
        self,
        change: impl FnOnce(dynid_motion::Log) -> Result<dynid_motion::Log, E>,
    ) -> Result<Log, E> {
        Ok(Log { log: change(self.log)?, ..self })
    }

    /// A log of a robot from arrays: [`Log::of_axes`] with the robot's.
    ///
    /// # Errors
    /// As [`Log::of_axes`].
    pub fn new(robot: &Robot, signals: dynid_motion::Log) -> Result<Log, Error> {
        Log::of_axes(&robot.axes, signals)
    }

    /// A log with signals of these axes from arrays, checked for what no joint does.
    ///
    /// `signals`: positions in rad or m, efforts in N m or N as the drives give them, those of a torque sensor as it reads; joints that are
    /// left out stand still at zero, efforts of links behind springs without a sensor do not count. Temperatures are channels called
    /// `temperature_<joint>`, °C. Positions of joints that turn and jump by full turns are unwrapped.
    ///
    /// # Errors
    /// [`Error::UnknownJoint`], [`Error::Degrees`], [`Error::FarPosition`], [`Error::Temperature`],
    /// [`Error::Log`].
    pub fn of_axes(axes: &[LogAxis], signals: dynid_motion::Log) -> Result<Log, Error> {
        let known = names(axes);
        let name = signals.name().to_owned();
        let rows = signals.rows();
        let (time, joints, channels) = signals.into_parts();
        let mut out = Signals { time, ..Signals::default() };
        let (mut velocities, mut efforts) = (Vec::new(), Vec::new());
        for (index, axis) in axes.iter().enumerate() {
            let Some(joint) = joints.iter().find(|j| j.name == axis.name) else {
                out.not_logged.push(axis.name.clone());
                continue;
            };
            out.joints.push(axis.name.clone());
            out.indices.push(index);
            out.position.push(joint.position.clone());
            velocities.push(joint.velocity.clone());
            efforts.push(match axis.effort {
                EffortColumn::Absent => vec![0.0; rows],
                EffortColumn::Sensor => joint.effort.iter().map(|e| -e).collect(),
                EffortColumn::Drive => joint.effort.clone(),
            });
        }
        if let Some(joint) = joints.iter().find(|j| !known.contains(&j.name)) {
            return Err(Error::UnknownJoint { name: joint.name.clone(), known });
        }
        drop(joints);
        out.velocity = velocities.into_iter().collect();
        out.effort = Some(efforts);
        out.channels = channels.into_iter().map(|c| (c.name, c.values)).collect();
        check(&out, axes, &name)?;
        let unwrapped = turns::unwrap(&mut out, axes);
        Ok(Log::of(assemble(&name, out)?, unwrapped, LogSource::default()))
    }

    /// A log that was read and checked.
    pub fn of(log: dynid_motion::Log, unwrapped: Vec<turns::Unwrapped>, source: LogSource) -> Log {
        Log { log, settings: LogSettings::default(), reference: None, unwrapped, source }
    }

    /// Returns the log with what an identification has to know beside its signals.
    #[must_use]
    pub fn with_settings(self, settings: LogSettings) -> Log {
        Log { settings, ..self }
    }

    /// Joints and motors of the robot that the log has no signals of.
    pub fn not_logged(&self, axes: &[LogAxis]) -> Vec<String> {
        let logged = |name: &String| self.log.joints().iter().any(|j| j.name == *name);
        names(axes).into_iter().filter(|name| !logged(name)).collect()
    }

    /// Data row of the file that a row of the log comes from, from 1.
    pub fn data_rows(&self) -> Vec<usize> {
        match self.source.rows.is_empty() {
            true => (1..=self.log.rows()).collect(),
            false => self.source.rows.clone(),
        }
    }

    /// Factors from effort columns to efforts, drive gains with currents, in the order of the log's joints; 1 for arrays.
    pub fn effort_factors(&self) -> Vec<f64> {
        let Some(mapping) = &self.source.mapping else { return vec![1.0; self.log.joints().len()] };
        mapping.effort.iter().flatten().flatten().map(|c| c.factor).collect()
    }

    /// Doubts about the signals and what was done to them, in words.
    pub fn warnings(&self) -> Vec<String> {
        let file = file_name(self.log.name());
        let turns = self.unwrapped.iter().map(|u| format!("{file}: {}", u.words()));
        // A header that is missing leaves room for doubt.
        let guessed = self.source.notes.iter().filter(|note| note.setting == "columns");
        let guessed = guessed.map(|note| {
            format!("{file}: columns without names are taken for {}: {}", note.value, note.reason)
        });
        let partly = ["damaged bag", "damaged file", "broken messages"];
        let partial = self.source.notes.iter().filter(|note| partly.contains(&note.setting.as_str()));
        let partial =
            partial.map(|note| format!("{file}: {}: {}: {}", note.setting, note.value, note.reason));
        turns.chain(guessed).chain(partial).chain(temperature_warnings(&self.log)).collect()
    }

    /// Conditions the log's signals; states of a motion with a stated period come from its Fourier series, after an average over
    /// its periods where settings ask for it. Of journals whose offsets are logged, the derivatives become channels.
    ///
    /// # Errors
    /// [`Error::Conditioning`]; [`Error::Pose`] for mechanisms with loops.
    pub fn prepare(&self, model: &RobotModel, settings: &ConditioningSettings) -> Result<PreparedLog, Error> {
        if let Some(closed) = model.closed() {
            poses::follow(closed, &self.log)?;
        }
        let mut prepared = prepare(&self.log, model, settings)?;
        if let Some(journals) = model.journals() {
            probes::derive(&mut prepared, journals, settings)?;
        }
        match self.settings.period_s {
            Some(period_s) if settings.average_periods => {
                Ok(prepared.averaged(period_s, &settings.noise)?.with_period(period_s)?)
            }
            Some(period_s) => Ok(prepared.with_period(period_s)?),
            None => Ok(prepared),
        }
    }
}

/// Refuses signals that no joint has: degrees taken for radians, encoder counts, temperatures of another unit.
///
/// # Errors
/// [`Error::Degrees`], [`Error::FarPosition`], [`Error::Temperature`].
pub fn check(signals: &Signals, axes: &[LogAxis], file: &str) -> Result<(), Error> {
    check_degrees(signals, axes, file)?;
    check_reach(signals, file)?;
    check_temperatures(signals, file)
}

/// Refuses signals of later rows that no joint has; whether positions are degrees is told by the first ones. `before`: rows before these.
///
/// # Errors
/// [`Error::FarPosition`], [`Error::Temperature`].
pub fn check_behind(signals: &Signals, file: &str, before: usize) -> Result<(), Error> {
    check_reach(signals, file)?;
    check_temperatures(signals, file).map_err(|e| match e {
        Error::Temperature { file, joint, row, found } => {
            Error::Temperature { file, joint, row: before + row, found }
        }
        other => other,
    })
}

/// A log of signals.
///
/// # Errors
/// [`Error::Log`].
pub fn assemble(file: &str, signals: Signals) -> Result<dynid_motion::Log, Error> {
    Ok(portion(signals).into_log(file)?)
}

/// Rows of a log of signals.
pub fn portion(signals: Signals) -> Portion {
    let Signals { time, joints: names, position, mut velocity, mut effort, temperature, channels, .. } =
        signals;
    let take = |list: &mut Option<Vec<Vec<f64>>>, k: usize| list.as_mut().map(|l| std::mem::take(&mut l[k]));
    let joints = names.iter().zip(position).enumerate().map(|(k, (name, position))| JointSignals {
        name: name.clone(),
        position,
        velocity: take(&mut velocity, k),
        effort: take(&mut effort, k).unwrap_or_default(),
    });
    let joints = joints.collect();
    let temperatures = temperature.into_iter().flat_map(|list| names.iter().zip(list));
    let measured = temperatures.filter_map(|(joint, values)| Some((temperature_channel(joint), values?)));
    let channels = channels.into_iter().chain(measured).map(|(name, values)| Channel { name, values });
    Portion { time, joints, channels: channels.collect() }
}

/// Refuses temperatures that no joint has.
fn check_temperatures(signals: &Signals, file: &str) -> Result<(), Error> {
    for (joint, values) in signals.joints.iter().zip(signals.temperature.iter().flatten()) {
        let doubt = values.as_ref().and_then(|values| temperature::doubt(values));
        if let Some(TemperatureDoubt::Implausible { sample, found }) = doubt {
            let (file, joint) = (file.to_owned(), joint.clone());
            return Err(Error::Temperature { file, joint, row: sample + 1, found });
        }
    }
    Ok(())
}

/// Refuses a temperature stated for a log that no element of the model reads.
pub fn check_stated_temperatures<'a>(
    logs: impl Iterator<Item = &'a LogSettings>,
    model: &RobotModel,
) -> Result<(), Error> {
    let reads = |joint: &str| model.channels().contains(&temperature_channel(joint));
    for log in logs {
        let unread = match &log.temperature {
            PerJoint::All(t) => (!model.joints().iter().any(|j| reads(&j.name))).then(|| t.to_string()),
            PerJoint::Each(map) => {
                map.iter().find(|(joint, _)| !reads(joint)).map(|(joint, t)| format!("{joint} = {t}"))
            }
        };
        if let Some(found) = unread {
            let expected = "temperatures of joints whose friction reads them from the log";
            return Err(Error::setting("log.temperature", expected, found));
        }
    }
    Ok(())
}

/// Name of a file without its folders.
fn file_name(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}

/// Doubts about the temperatures of a log, in words.
pub fn temperature_warnings(log: &dynid_motion::Log) -> Vec<String> {
    let file = file_name(log.name());
    let doubtful = log.channels().iter().filter(|c| is_temperature(&c.name));
    doubtful
        .filter_map(|c| match temperature::doubt(&c.values)? {
            TemperatureDoubt::LooksLikeFahrenheit { least, greatest } => Some(format!(
                "{file}: `{}` lies between {least:.0} and {greatest:.0}: if these are degrees Fahrenheit, say so (unit \"F\")",
                c.name
            )),
            _ => None,
        })
        .collect()
}

/// Whether the positions of a log look like degrees although radians are said.
pub fn degrees(loaded: &Log, axes: &[LogAxis]) -> Option<Error> {
    let of_joint = |joint: &JointSignals| axes.iter().position(|a| a.name == joint.name);
    let joints = loaded.log.joints();
    let signals = Signals {
        joints: joints.iter().map(|j| j.name.clone()).collect(),
        indices: joints.iter().filter_map(of_joint).collect(),
        position: joints.iter().map(|j| j.position.clone()).collect(),
        ..Signals::default()
    };
    check_degrees(&signals, axes, loaded.log.name()).err()
}

fn check_degrees(signals: &Signals, axes: &[LogAxis], file: &str) -> Result<(), Error> {
    // Motors turn as often as their gears say.
    let turning: Vec<usize> = (0..signals.joints.len())
        .filter(|k| !axes[signals.indices[*k]].slides && !axes[signals.indices[*k]].motor)
        .collect();
    let positions: Vec<Vec<f64>> = turning.iter().map(|k| signals.position[*k].clone()).collect();
    let limits: Vec<Option<(f64, f64)>> =
        turning.iter().map(|k| axes[signals.indices[*k]].limits.position).collect();
    match dynid_logs::columns::degrees_suspected(&positions, &limits) {
        None => Ok(()),
        Some(evidence) => Err(Error::Degrees {
            file: file.to_owned(),
            joint: signals.joints[turning[evidence.joint]].clone(),
            largest: evidence.largest,
            limit: evidence.limit,
        }),
    }
}

/// Largest position that is taken for one, rad or m: beyond any cable drum or track, below encoder counts.
pub const LARGEST_POSITION: f64 = 1e6;

fn check_reach(signals: &Signals, file: &str) -> Result<(), Error> {
    for (joint, position) in signals.joints.iter().zip(&signals.position) {
        let largest = largest(position);
        if largest > LARGEST_POSITION {
            let (file, joint) = (file.to_owned(), joint.clone());
            return Err(Error::FarPosition { file, joint, limit: LARGEST_POSITION, largest });
        }
    }
    Ok(())
}

/// How columns were understood: signal, column names.
pub fn understood(mapping: &ColumnMapping) -> Vec<(String, String)> {
    let list = |columns: &[Option<dynid_logs::columns::ColumnUse>]| {
        columns.iter().flatten().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ")
    };
    let mut out = vec![(
        "time".to_owned(),
        match &mapping.time {
            dynid_logs::columns::TimeSource::Columns(time) => {
                time.parts.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ")
            }
            dynid_logs::columns::TimeSource::Rate(r) => format!("{r} Hz"),
        },
    )];
    out.push(("position".to_owned(), list(&mapping.position)));
    if let Some(effort) = &mapping.effort {
        out.push(("effort".to_owned(), list(effort)));
    }
    if let Some(temperature) = &mapping.temperature {
        out.push(("temperature".to_owned(), list(temperature)));
    }
    for (name, column) in &mapping.channels {
        out.push((name.clone(), column.name.clone()));
    }
    out
}
