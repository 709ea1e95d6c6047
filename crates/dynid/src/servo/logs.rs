//! Logs of commands and positions from files.

use dynid_io::columns::{ColumnNames, EffortColumn, FullSignal, SignalSpec};
use dynid_io::{MappingSpec, Signals};
use dynid_servo::ServoLog;

use super::ServoFault;
use super::config::{CommandColumns, ServoConfig, ServoLogConfig};
use crate::Error;
use crate::estimate::InputRecord;
use crate::log::LogAxis;
use crate::logs;
use crate::robot::Robot;

/// What stands before or behind a joint's name in columns of commands.
const COMMANDS: [&str; 18] = [
    "cmd",
    "q_cmd",
    "cmd_q",
    "command",
    "q_command",
    "commanded",
    "target",
    "q_target",
    "desired",
    "q_desired",
    "des",
    "q_des",
    "reference",
    "q_ref",
    "ref",
    "setpoint",
    "goal",
    "action",
];

/// A log as it was read.
#[derive(Debug)]
pub(super) struct ReadLog {
    pub(super) log: ServoLog,
    /// Joints without columns.
    pub(super) not_logged: Vec<String>,
    pub(super) inputs: Vec<InputRecord>,
    pub(super) warnings: Vec<String>,
}

/// Gap of the clock, in periods, behind which a rollout begins anew.
const GAP: f64 = 5.0;

/// Reads a log; `robot` has the joints that move.
///
/// # Errors
/// As [`logs::load`]; [`ServoFault`] if there is no command, or its unit is another.
pub(super) fn read(config: &ServoConfig, log: &ServoLogConfig, robot: &Robot) -> Result<ReadLog, Error> {
    let plain = log.plain();
    let axes: Vec<LogAxis> =
        robot.axes.iter().map(|a| LogAxis { effort: EffortColumn::Absent, ..a.clone() }).collect();
    let columns = log.columns.as_ref().unwrap_or(&config.columns);
    let file = log.path.display().to_string();
    let without_effort = |columns: &MappingSpec| MappingSpec {
        allow_unlogged: true,
        allow_no_effort: true,
        effort: None,
        ..columns.clone()
    };
    let own = crate::config::LogConfig { columns: None, ..plain.clone() };
    let (measured, input) = logs::positions(&own, &axes, &without_effort(columns))?;
    let not_logged = measured.not_logged.clone();
    let logged: Vec<LogAxis> = axes.iter().filter(|a| !not_logged.contains(&a.name)).cloned().collect();
    // Every joint that has positions has a command: signals are read as what they are, an effort is no position that may be far.
    let with = |columns: MappingSpec, axes: &[LogAxis]| -> Result<Signals, Error> {
        let (read, _) = logs::positions(&own, axes, &MappingSpec { allow_unlogged: false, ..columns })?;
        if read.time.len() != measured.time.len() {
            let (commands, positions) = (read.time.len(), measured.time.len());
            return Err(ServoFault::Rows { file: file.clone(), commands, positions }.into());
        }
        Ok(read)
    };
    let CommandColumns { position, velocity, effort } = &config.command;
    let names: Vec<&str> = logged.iter().map(|a| a.name.as_str()).collect();
    let position = match position {
        Some(spec) => spec.clone(),
        None => guess(&plain, columns, &names)?
            .ok_or_else(|| ServoFault::NoCommand { file: file.clone(), joint: names.join(", ") })?,
    };
    let plain_columns = without_effort(columns);
    let told = MappingSpec { position: Some(position), velocity: None, ..plain_columns.clone() };
    let command = with(told, &logged)?.position;
    let mut velocities = Vec::new();
    if velocity.is_some() {
        let told = MappingSpec { velocity: velocity.clone(), ..plain_columns.clone() };
        velocities = with(told, &logged)?.velocity.unwrap_or_default();
    }
    let mut efforts = Vec::new();
    if effort.is_some() {
        let driven: Vec<LogAxis> =
            logged.iter().map(|a| LogAxis { effort: EffortColumn::Drive, ..a.clone() }).collect();
        let told = MappingSpec { effort: effort.clone(), allow_no_effort: false, ..plain_columns };
        efforts = with(told, &driven)?.effort.unwrap_or_default();
    }
    let positions = &measured.position;
    for ((name, u), x) in names.iter().zip(&command).zip(positions) {
        let (told, done) = (spread(u), spread(x));
        // Degrees beside radians differ by 57, and no drive falls short of a moving command by so much; one that stands still does.
        if told > 20.0 * done && told < 200.0 * done {
            return Err(ServoFault::Unit {
                file: file.clone(),
                joint: (*name).to_owned(),
                ratio: told / done,
            }
            .into());
        }
    }
    let mut warnings = Vec::new();
    let part = part_of(&measured.time, plain.part);
    let keep: Vec<usize> = growing(&measured.time[part.clone()]).iter().map(|k| k + part.start).collect();
    if keep.len() < part.len() {
        let out = part.len() - keep.len();
        warnings.push(format!("{file}: {out} rows are left out, their time does not grow"));
    }
    let pick = |values: &[f64]| keep.iter().map(|k| values[*k]).collect::<Vec<f64>>();
    let picked = |all: &[Vec<f64>]| all.iter().map(|v| pick(v)).collect::<Vec<_>>();
    let label = log.path.file_name().map_or_else(|| file.clone(), |n| n.to_string_lossy().into_owned());
    let mut out = ServoLog::new(label, pick(&measured.time), picked(&command), picked(positions));
    out.velocity_command = picked(&velocities);
    out.feed_forward = picked(&efforts);
    let period = out.period();
    out.breaks = (1..out.rows()).filter(|k| out.time[*k] - out.time[k - 1] > GAP * period).collect();
    if !out.breaks.is_empty() {
        let gaps = out.breaks.len();
        warnings.push(format!(
            "{file}: {gaps} gaps of more than {GAP} periods: the simulation begins anew behind each"
        ));
    }
    Ok(ReadLog { log: out, not_logged, inputs: vec![input], warnings })
}

/// Rows of a part of a record, stated as shares.
fn part_of(time: &[f64], part: Option<(f64, f64)>) -> std::ops::Range<usize> {
    let at = |share: f64| ((share * time.len() as f64).round() as usize).min(time.len());
    part.map_or(0..time.len(), |(a, b)| at(a)..at(b).max(at(a)))
}

fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    (values.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / values.len() as f64).sqrt()
}

/// Rows whose time is later than that of all rows before.
fn growing(time: &[f64]) -> Vec<usize> {
    let mut last = f64::NEG_INFINITY;
    let mut out = Vec::with_capacity(time.len());
    for (k, t) in time.iter().enumerate() {
        if *t > last {
            last = *t;
            out.push(k);
        }
    }
    out
}

/// A pattern of column names that all joints have.
fn guess(
    log: &crate::config::LogConfig,
    columns: &MappingSpec,
    joints: &[&str],
) -> Result<Option<SignalSpec>, Error> {
    let header = dynid_io::log::open(&log.path, &columns.options(log.rows))?.header().names;
    let has = |name: &str| header.iter().any(|h| h.trim() == name);
    let mut patterns = Vec::new();
    for word in COMMANDS {
        for separator in ["_", ".", "/"] {
            patterns.push(format!("{word}{separator}{{joint}}"));
            patterns.push(format!("{{joint}}{separator}{word}"));
            patterns.push(format!("{word}{separator}{{joint}}.pos"));
        }
    }
    let found = patterns.into_iter().find(|p| joints.iter().all(|j| has(&p.replace("{joint}", j))));
    // A unit that is stated for the positions is that of the commands.
    let unit = match &columns.position {
        Some(SignalSpec::Full(full)) => full.unit.clone(),
        _ => None,
    };
    Ok(found.map(|pattern| {
        let columns = ColumnNames::Pattern(pattern);
        match unit {
            Some(unit) => {
                SignalSpec::Full(FullSignal { columns, unit: Some(unit), scale: None, offset: None })
            }
            None => SignalSpec::Names(columns),
        }
    }))
}
