//! From log files to checked logs.

use std::path::Path;

use dynid_files::FileMember;
use dynid_files::SourceFile;
use dynid_logs::columns::{ColumnNames, FullSignal, SignalSpec};
use dynid_logs::{ColumnMapping, MappingError, MappingSpec, ReadingNote, Signals, TrajectoryFile};
use dynid_motion::temperature::{self, TemperatureDoubt};
use sha2::{Digest, Sha256};

mod known_motion;
mod long;
mod reading;

pub use long::{Opened, open};

pub use reading::map_columns;
pub use reading::{WholeTable, table};

use crate::config::{InstrumentsConfig, LogConfig, MotorSide};
use dynid_identify::Error;
use dynid_identify::estimate::{InputKind, InputRecord};
use dynid_identify::log::{Log, LogAxis, LogReference, LogSource, assemble, check, names, turns, understood};

/// Reads a log of a robot ([`Robot::axes`](dynid_identify::robot::Robot)).
///
/// # Errors
/// [`Error::LogFile`], [`Error::Columns`], [`Error::SurplusColumn`], [`Error::Setting`], [`Error::Log`],
/// [`Error::Degrees`], [`Error::FarPosition`], [`Error::Temperature`], [`Error::UnknownJoint`], [`Error::TrajectoryFile`], [`Error::TrajectoryJoints`].
pub fn load(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Log, Error> {
    let read = read(config, axes, run_columns, motor_side)?;
    let file = config.path.display().to_string();
    check(&read.signals, axes, &file)?;
    finish(config, &file, read, axes)
}

/// Loads a log without refusing numbers for what they seem to be: units of angles, counts, temperatures.
///
/// # Errors
/// Fails as [`load`] does, without [`Error::Degrees`], [`Error::FarPosition`] and [`Error::Temperature`].
pub fn load_as_it_is(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Log, Error> {
    let read = read(config, axes, run_columns, motor_side)?;
    finish(config, &config.path.display().to_string(), read, axes)
}

/// Positions of a robot in a log of any effort or none, checked and unwrapped, and where they come from. `part` of the log is not cut.
pub fn positions(
    config: &LogConfig,
    axes: &[LogAxis],
    columns: &MappingSpec,
) -> Result<(Signals, InputRecord), Error> {
    let Read { mut signals, source, .. } = read(config, axes, columns, None)?;
    check(&signals, axes, &config.path.display().to_string())?;
    turns::unwrap(&mut signals, axes);
    Ok((signals, InputRecord::of(InputKind::Log, &source)))
}

/// Signals of a robot in a log, in SI, as they were recorded, and what was found out about reading it.
pub fn recorded(
    config: &LogConfig,
    axes: &[LogAxis],
    columns: &MappingSpec,
) -> Result<(Signals, Vec<ReadingNote>), Error> {
    let mut understood = reading::understand(config, axes, columns, false)?;
    let signals = understood.signals().map_err(|source| columns_error(config, source))?;
    Ok((signals, understood.notes))
}

/// A file as it was read.
struct Read {
    signals: Signals,
    mapping: ColumnMapping,
    source: SourceFile,
    unwrapped: Vec<turns::Unwrapped>,
    notes: Vec<ReadingNote>,
    /// Those that the columns state.
    channels: Vec<String>,
    by_number: bool,
    on_motors: bool,
}

fn read(
    config: &LogConfig,
    axes: &[LogAxis],
    run_columns: &MappingSpec,
    motor_side: Option<&MotorSide>,
) -> Result<Read, Error> {
    let spec = config.columns.as_ref().unwrap_or(run_columns);
    let mut understood = reading::understand(config, axes, spec, motor_side.is_some())?;
    let signals = understood.signals().map_err(|source| columns_error(config, source))?;
    of_signals(config, axes, spec, motor_side, understood, signals)
}

fn columns_error(config: &LogConfig, source: MappingError) -> Error {
    Error::Columns { file: config.path.display().to_string(), source: Box::new(source) }
}

/// A file whose signals are those of its columns.
fn of_signals(
    config: &LogConfig,
    axes: &[LogAxis],
    spec: &MappingSpec,
    motor_side: Option<&MotorSide>,
    understood: reading::Understood,
    mut signals: Signals,
) -> Result<Read, Error> {
    let file = config.path.display().to_string();
    let joints = names(axes);
    let reading::Understood { table, mapping, notes } = understood;
    let source = SourceFile { path: file, sha256: table.sha256 };
    let mut unwrapped = Vec::new();
    if let Some(transmission) = motor_side {
        // Behind a transmission a turn of a motor is no turn of a joint.
        unwrapped = turns::unwrap(&mut signals, axes);
        to_joint_side(&mut signals, transmission)?;
    }
    state_temperatures(&mut signals, config, &joints)?;
    let channels = spec.channels.keys().cloned().collect();
    let (by_number, on_motors) = (by_number(spec), motor_side.is_some());
    Ok(Read { signals, mapping, source, unwrapped, notes, channels, by_number, on_motors })
}

/// Whether joints are told by the numbers of columns alone.
fn by_number(spec: &MappingSpec) -> bool {
    let is_numbered = |spec: &SignalSpec| {
        let (SignalSpec::Full(FullSignal { columns, .. }) | SignalSpec::Names(columns)) = spec;
        matches!(columns, ColumnNames::Pattern(pattern) if !pattern.contains("{joint}"))
    };
    spec.position.as_ref().is_none_or(is_numbered)
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

fn finish(config: &LogConfig, file: &str, read: Read, axes: &[LogAxis]) -> Result<Log, Error> {
    let Read { mut signals, mapping, source, mut unwrapped, notes, channels, by_number, on_motors } = read;
    // Many turns look like degrees: units were judged before.
    unwrapped.extend(turns::unwrap(&mut signals, axes));
    let joints: Vec<String> = mapping.joints.clone();
    let numbers = numbers(&signals, config.rows.map_or(1, |(first, _)| first));
    let whole = assemble(file, signals)?;
    let times = whole.time().to_vec();
    let log = left_out(whole, config, &numbers)?;
    let mut inputs = vec![InputRecord::of(InputKind::Log, &source)];
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
            inputs.push(InputRecord::of(InputKind::Trajectory, &source));
            (log, Some(period_s))
        }
        None => (log, config.period_s),
    };
    let columns = understood(&mapping);
    let rows = data_rows(&times, log.time(), &numbers);
    let source = LogSource {
        columns,
        mapping: Some(mapping),
        by_number,
        on_motors,
        rows,
        inputs,
        notes,
        stated_channels: channels,
        ..LogSource::default()
    };
    let mut settings = config.settings();
    settings.period_s = period_s;
    Ok(Log::of(log, unwrapped, source).with_settings(settings))
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
fn left_out(
    log: dynid_motion::Log,
    config: &LogConfig,
    numbers: &[usize],
) -> Result<dynid_motion::Log, Error> {
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

/// The motion that the controller of a log was told to follow, where a trajectory file says so.
///
/// # Errors
/// [`Error::TrajectoryFile`].
pub fn reference(table: Option<&InstrumentsConfig>, log: &LogConfig) -> Result<Option<LogReference>, Error> {
    let Some(table) = table else { return Ok(None) };
    let own = table.trajectory.as_ref();
    let Some(path) = own.or(log.trajectory.as_ref()) else { return Ok(None) };
    Ok(Some(LogReference {
        trajectory: TrajectoryFile::read(path)?,
        file: path.display().to_string(),
        // Logs with a trajectory of their own are cut to its record.
        cut: own.is_none(),
        part: log.part.is_some() || log.rows.is_some(),
    }))
}

/// Turns motor positions and efforts into those of the joints.
pub fn to_joint_side(signals: &mut Signals, transmission: &MotorSide) -> Result<(), Error> {
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
    let inverse = dynid_identify::elements::inverse(matrix)
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

/// Refuses `q1..q7` for six joints: which of the seven is not the robot's, numbers do not tell.
pub fn check_surplus(
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

/// Checks that columns which state drive gains state one per joint.
///
/// # Errors
/// [`Error::Setting`].
pub fn check_gains(spec: &MappingSpec, joints: usize) -> Result<(), Error> {
    match &spec.current_gains {
        Some(gains) if gains.len() != joints => Err(Error::Setting {
            name: "current_gains".to_owned(),
            expected: format!("{joints} drive gains, one per joint"),
            found: gains.len().to_string(),
        }),
        _ => Ok(()),
    }
}

/// Columns of a log that was read from a file.
pub fn mapping_of(log: &Log) -> &ColumnMapping {
    let mapping = log.source.mapping.as_ref();
    mapping.unwrap_or_else(|| unreachable!("logs from files have columns"))
}

/// SHA-256 of a file, hexadecimal; of `FILE#MEMBER` that of the whole file.
///
/// # Errors
/// [`Error::Read`].
pub fn sha256(path: &Path) -> Result<String, Error> {
    let read_error = |source| Error::Read { file: path.to_owned(), source };
    let mut file = dynid_files::input::open(&FileMember::of(path).path).map_err(read_error)?;
    let mut hasher = Sha256::new();
    std::io::copy(&mut file, &mut hasher).map_err(read_error)?;
    Ok(hasher.finalize().iter().map(|b| format!("{b:02x}")).collect())
}
