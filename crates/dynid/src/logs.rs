//! From log files to checked logs.

use std::path::Path;

use dynid_io::{ColumnMapping, MappingSpec, ReadingNote, Signals, SourceFile};
use dynid_model::element::{is_temperature, temperature_channel};
use dynid_model::{EffortModel, Limits, RobotModel};
use dynid_motion::temperature::{self, TemperatureDoubt};
use dynid_motion::{Channel, JointSignals, Log};
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, prepare};
use sha2::{Digest, Sha256};

mod axes;
mod known_motion;
pub(crate) mod poses;
mod reading;
pub mod turns;

pub use axes::{LogAxis, as_logged, axes, names};
pub use reading::table;
pub(crate) use reading::{header, map_columns};

use crate::Error;
use crate::config::{LogConfig, MotorSide, PerJoint};
use crate::estimate::InputRecord;

/// A log that was read, with what was read besides signals.
#[derive(Debug, Clone)]
pub struct LoadedLog {
    /// Signals.
    pub log: Log,
    /// Joints of the robot without columns.
    pub not_logged: Vec<String>,
    /// How columns were understood: signal, column names.
    pub columns: Vec<(String, String)>,
    /// Period of the motion, if one was stated, s.
    pub period_s: Option<f64>,
    /// Columns of every signal with their factors.
    pub mapping: ColumnMapping,
    /// Per row of the log: its data row in the file, from 1.
    pub rows: Vec<usize>,
    /// Files that were read: the log, and its trajectory.
    pub inputs: Vec<InputRecord>,
    /// Positions that jumped by full turns and were unwrapped.
    pub unwrapped: Vec<turns::Unwrapped>,
    /// How the file was read where that was found out: format, decimal mark, unit of the time, rows without a value.
    pub reading: Vec<ReadingNote>,
}

impl LoadedLog {
    /// Factors from effort columns to efforts, drive gains with currents, in the order of the log's joints; empty without.
    pub fn effort_factors(&self) -> Vec<f64> {
        self.mapping.effort.iter().flatten().flatten().map(|c| c.factor).collect()
    }

    /// Doubts about the signals and what was done to them, in words.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let file = file_name(self.log.name());
        let turns = self.unwrapped.iter().map(|u| format!("{file}: {}", u.words()));
        // A header that is missing leaves room for doubt.
        let guessed = self.reading.iter().filter(|note| note.setting == "columns");
        let guessed = guessed.map(|note| {
            format!("{file}: columns without names are taken for {}: {}", note.value, note.reason)
        });
        turns.chain(guessed).chain(temperature_warnings(&self.log)).collect()
    }

    /// Conditions the log's signals; states of a motion with a stated period come from its Fourier series.
    ///
    /// # Errors
    /// [`Error::Conditioning`]; [`Error::Pose`] for mechanisms with loops.
    pub fn prepare(&self, model: &RobotModel, settings: &ConditioningSettings) -> Result<PreparedLog, Error> {
        if let Some(closed) = model.closed() {
            poses::follow(closed, &self.log)?;
        }
        let prepared = prepare(&self.log, model, settings)?;
        match self.period_s {
            Some(period_s) => Ok(prepared.with_period(period_s)?),
            None => Ok(prepared),
        }
    }
}

/// Reads a log of a robot ([`Robot::axes`](crate::robot::Robot), [`axes`]).
///
/// # Errors
/// [`Error::LogFile`], [`Error::Columns`], [`Error::SurplusColumn`], [`Error::Setting`], [`Error::Log`],
/// [`Error::Degrees`], [`Error::FarPosition`], [`Error::Temperature`], [`Error::UnknownJoint`], [`Error::TrajectoryFile`], [`Error::TrajectoryJoints`].
pub fn load(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<LoadedLog, Error> {
    let read = read(config, axes, run_columns, motor_side)?;
    let (file, signals) = (config.path.display().to_string(), &read.signals);
    check_degrees(signals, axes, &file)?;
    check_reach(signals, &file)?;
    check_temperatures(signals, &file)?;
    finish(config, &file, read, axes)
}

/// Loads a log without refusing numbers for what they seem to be: units of angles, counts, temperatures.
///
/// # Errors
/// Fails as [`load`] does, without [`Error::Degrees`], [`Error::FarPosition`] and [`Error::Temperature`].
pub(crate) fn load_as_it_is(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<LoadedLog, Error> {
    let read = read(config, axes, run_columns, motor_side)?;
    finish(config, &config.path.display().to_string(), read, axes)
}

/// A file as it was read.
struct Read {
    signals: Signals,
    mapping: ColumnMapping,
    source: SourceFile,
    unwrapped: Vec<turns::Unwrapped>,
    notes: Vec<ReadingNote>,
}

fn read(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Read, Error> {
    let file = config.path.display().to_string();
    let spec = config.columns.as_ref().unwrap_or(run_columns);
    let joints = names(axes);
    let mut understood = reading::understand(config, axes, spec, motor_side.is_some())?;
    let named = |source| Error::Columns { file: file.clone(), source: Box::new(source) };
    let mut signals = understood.signals().map_err(named)?;
    let reading::Understood { table, mapping, notes } = understood;
    let source = SourceFile { path: file, sha256: table.sha256 };
    let mut unwrapped = Vec::new();
    if let Some(transmission) = motor_side {
        // Behind a transmission a turn of a motor is no turn of a joint.
        unwrapped = turns::unwrap(&mut signals, axes);
        to_joint_side(&mut signals, transmission)?;
    }
    state_temperatures(&mut signals, config, &joints)?;
    Ok(Read { signals, mapping, source, unwrapped, notes })
}

/// Puts the temperatures that a configuration states in place of the logged ones.
fn state_temperatures(signals: &mut Signals, config: &LogConfig, joints: &[String]) -> Result<(), Error> {
    if config.temperature.is_none() {
        return Ok(());
    }
    let stated = config.temperature.finite("log.temperature", joints)?;
    let implausible =
        |t: &&f64| matches!(temperature::doubt(&[**t]), Some(TemperatureDoubt::Implausible { .. }));
    if let Some(found) = stated.iter().flatten().find(implausible) {
        return Err(Error::setting("log.temperature", "degrees Celsius that a joint may have", found));
    }
    let rows = signals.time.len();
    let logged = signals.temperature.get_or_insert_with(|| vec![None; signals.joints.len()]);
    for (joint, values) in signals.indices.iter().zip(logged) {
        if let Some(t) = stated[*joint] {
            *values = Some(vec![t; rows]);
        }
    }
    Ok(())
}

fn finish(config: &LogConfig, file: &str, read: Read, axes: &[LogAxis]) -> Result<LoadedLog, Error> {
    let Read { mut signals, mapping, source, mut unwrapped, notes } = read;
    // Many turns look like degrees: units were judged before.
    unwrapped.extend(turns::unwrap(&mut signals, axes));
    let joints: Vec<String> = mapping.joints.clone();
    let not_logged = signals.not_logged.clone();
    let numbers = numbers(&signals, config.rows.map_or(1, |(first, _)| first));
    let whole = assemble(file, signals)?;
    let times = whole.time().to_vec();
    let log = left_out(whole, config, &numbers)?;
    let mut inputs = vec![InputRecord::of("log", &source)];
    let log = match config.part {
        None => log,
        Some((from, to)) => {
            let rows = log.rows() as f64;
            log.slice((from * rows).round() as usize..(to * rows).round() as usize)?
        }
    };
    let (log, period_s) = match &config.trajectory {
        Some(path) => {
            let cut = config.part.is_none() && config.rows.is_none();
            let (log, period_s, source) = known_motion::record(log, path, &joints, cut)?;
            inputs.push(InputRecord::of("trajectory", &source));
            (log, Some(period_s))
        }
        None => (log, config.period_s),
    };
    let columns = describe(&mapping);
    let rows = data_rows(&times, log.time(), &numbers);
    Ok(LoadedLog { period_s, log, not_logged, columns, mapping, rows, inputs, unwrapped, reading: notes })
}

/// Data rows of the samples of a log. `first`: data row that its table begins with.
fn numbers(signals: &Signals, first: usize) -> Vec<usize> {
    match &signals.rows {
        Some(rows) => rows.iter().map(|row| first + row).collect(),
        None => (first..first + signals.time.len()).collect(),
    }
}

/// Data rows of the rows that are left of a log, which keep their times and their order. `numbers`: data row of every time.
fn data_rows(times: &[f64], left: &[f64], numbers: &[usize]) -> Vec<usize> {
    let mut at = 0;
    left.iter()
        .map(|time| {
            while at + 1 < times.len() && times[at] != *time {
                at += 1;
            }
            at += 1;
            numbers[at - 1]
        })
        .collect()
}

/// The log without the rows that its configuration leaves out; the clock takes what is missing for a gap.
fn left_out(log: Log, config: &LogConfig, numbers: &[usize]) -> Result<Log, Error> {
    let mut keep = vec![true; log.rows()];
    for (from, to) in &config.leave_out {
        let (from, to) = (numbers.partition_point(|n| n < from), numbers.partition_point(|n| n <= to));
        keep[from..to.max(from)].fill(false);
    }
    if config.drop_repeated {
        for row in dynid_motion::faults::repeated(&log).rows {
            keep[row] = false;
        }
    }
    if keep.iter().all(|k| *k) { Ok(log) } else { Ok(log.retain(&keep)?) }
}

/// Turns motor positions and efforts into those of the joints.
pub(crate) fn to_joint_side(signals: &mut Signals, transmission: &MotorSide) -> Result<(), Error> {
    let n = signals.joints.len();
    let matrix = &transmission.matrix;
    let setting =
        |expected: String, found: String| Error::Setting { name: "motor_side".to_owned(), expected, found };
    if matrix.len() != n || matrix.iter().any(|row| row.len() != n) {
        let widths: Vec<usize> = matrix.iter().map(Vec::len).collect();
        return Err(setting(format!("a matrix of {n} rows of {n}"), format!("rows of {widths:?}")));
    }
    if !matrix.iter().flatten().all(|x| x.is_finite()) {
        return Err(setting("finite numbers".to_owned(), format!("{matrix:?}")));
    }
    if !transmission.offset.is_empty() && transmission.offset.len() != n {
        return Err(setting(format!("{n} offsets"), transmission.offset.len().to_string()));
    }
    let inverse = crate::elements::inverse(matrix)
        .ok_or_else(|| setting("a regular matrix".to_owned(), "a singular one".to_owned()))?;
    let offset = |j: usize| transmission.offset.get(j).copied().unwrap_or(0.0);
    signals.position = combine(&signals.position, &inverse, offset);
    signals.velocity = signals.velocity.as_ref().map(|v| combine(v, &inverse, |_| 0.0));
    let transposed: Vec<Vec<f64>> = (0..n).map(|j| matrix.iter().map(|row| row[j]).collect()).collect();
    signals.effort = signals.effort.as_ref().map(|e| combine(e, &transposed, |_| 0.0));
    Ok(())
}

fn combine(signals: &[Vec<f64>], matrix: &[Vec<f64>], offset: impl Fn(usize) -> f64) -> Vec<Vec<f64>> {
    let samples = signals.first().map_or(0, Vec::len);
    matrix
        .iter()
        .enumerate()
        .map(|(j, row)| {
            let mut out = vec![offset(j); samples];
            for (factor, signal) in row.iter().zip(signals).filter(|(f, _)| **f != 0.0) {
                for (o, x) in out.iter_mut().zip(signal) {
                    *o += factor * x;
                }
            }
            out
        })
        .collect()
}

fn assemble(file: &str, signals: Signals) -> Result<Log, Error> {
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
    Ok(Log::new(file, time, joints, channels.collect())?)
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
pub(crate) fn check_stated_temperatures<'a>(
    logs: impl Iterator<Item = &'a LogConfig>,
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
pub(crate) fn temperature_warnings(log: &Log) -> Vec<String> {
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
pub(crate) fn degrees(loaded: &LoadedLog, axes: &[LogAxis]) -> Option<Error> {
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
    let limits: Vec<Limits> = turning.iter().map(|k| axes[signals.indices[*k]].limits).collect();
    match dynid_io::columns::degrees_suspected(&positions, &limits) {
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
pub(crate) const LARGEST_POSITION: f64 = 1e6;

fn check_reach(signals: &Signals, file: &str) -> Result<(), Error> {
    for (joint, position) in signals.joints.iter().zip(&signals.position) {
        let largest = position.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
        if largest > LARGEST_POSITION {
            let (file, joint) = (file.to_owned(), joint.clone());
            return Err(Error::FarPosition { file, joint, limit: LARGEST_POSITION, largest });
        }
    }
    Ok(())
}

/// Refuses `q1..q7` for six joints: which of the seven is not the robot's, numbers do not tell.
pub(crate) fn check_surplus(
    mapping: &ColumnMapping,
    joints: &[String],
    header: &[String],
    file: &str,
) -> Result<(), Error> {
    let (Some(Some(last)), Some(joint)) = (mapping.position.last(), joints.last()) else { return Ok(()) };
    let bare = last.name.trim_end_matches([']', ')']);
    let stem = bare.trim_end_matches(|c: char| c.is_ascii_digit());
    let Ok(number) = bare[stem.len()..].parse::<u32>() else { return Ok(()) };
    let column = format!("{stem}{}{}", u64::from(number) + 1, &last.name[bare.len()..]);
    if last.name.contains(joint.as_str()) || !header.contains(&column) {
        return Ok(());
    }
    Err(Error::SurplusColumn { file: file.to_owned(), expected: joints.len(), column })
}

pub(crate) fn check_gains(spec: &MappingSpec, joints: usize) -> Result<(), Error> {
    match &spec.current_gains {
        Some(gains) if gains.len() != joints => Err(Error::Setting {
            name: "current_gains".to_owned(),
            expected: format!("{joints} drive gains, one per joint"),
            found: gains.len().to_string(),
        }),
        _ => Ok(()),
    }
}

fn describe(mapping: &ColumnMapping) -> Vec<(String, String)> {
    let list = |columns: &[Option<dynid_io::columns::ColumnUse>]| {
        columns.iter().flatten().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ")
    };
    let mut out = vec![(
        "time".to_owned(),
        match &mapping.time {
            dynid_io::columns::TimeSource::Columns(time) => {
                time.parts.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(" ")
            }
            dynid_io::columns::TimeSource::Rate(r) => format!("{r} Hz"),
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

/// SHA-256 of a file, hexadecimal.
///
/// # Errors
/// [`Error::Read`].
pub fn sha256(path: &Path) -> Result<String, Error> {
    let read_error = |source| Error::Read { file: path.to_owned(), source };
    let mut file = dynid_io::input::open(path).map_err(read_error)?;
    let mut hasher = Sha256::new();
    std::io::copy(&mut file, &mut hasher).map_err(read_error)?;
    Ok(hasher.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
