//! Logs of commands and positions from files.

use dynid_config::logs;
use dynid_identify::Error;
use dynid_identify::estimate::InputRecord;
use dynid_identify::log::LogAxis;
use dynid_identify::robot::Robot;
use dynid_logs::columns::{ColumnNames, EffortColumn, FullSignal, MappingError, SignalSpec};
use dynid_logs::{ColumnMapping, MappingSpec, Signals};
use dynid_servo::identify::ServoError;
use dynid_servo::{Channel, ServoLog};

use super::ServoFault;
use super::config::{ChannelName, CommandColumns, ServoConfig, ServoLogConfig};

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
    /// Columns of efforts or currents that the run states and this log does not have.
    pub(super) without: Vec<(Channel, Error)>,
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
        current_gains: None,
        ..columns.clone()
    };
    let own = dynid_config::config::LogConfig { columns: None, ..plain.clone() };
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
    let mut seen = Measurements {
        file: &file,
        config,
        own: &own,
        columns,
        shared: log.columns.is_none(),
        joints: &logged,
        rows: measured.time.len(),
        warnings: Vec::new(),
        without: Vec::new(),
    };
    let measured_effort = seen.effort()?;
    let measured_current = seen.current(measured_effort.is_empty())?;
    let measured_velocity = seen.velocity()?;
    let (mut warnings, without) = (seen.warnings, seen.without);
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
    out.effort = picked(&measured_effort);
    out.current = picked(&measured_current);
    out.velocity = picked(&measured_velocity);
    let spikes = out.leave_out_spikes();
    let spikes =
        spikes.map_err(|source| ServoFault::Fit(ServoError::Signal { log: out.name.clone(), source }))?;
    for (j, count) in spikes {
        let joint = names[j];
        warnings.push(format!("{file}: spikes in the position of {joint} are left out, {count} readings"));
    }
    let period = out.period();
    out.breaks = (1..out.rows()).filter(|k| out.time[*k] - out.time[k - 1] > GAP * period).collect();
    if !out.breaks.is_empty() {
        let gaps = out.breaks.len();
        warnings.push(format!(
            "{file}: {gaps} gaps of more than {GAP} periods: the simulation begins anew behind each"
        ));
    }
    Ok(ReadLog { log: out, not_logged, inputs: vec![input], warnings, without })
}

/// Reads what a log measures beside positions.
struct Measurements<'a> {
    file: &'a str,
    config: &'a ServoConfig,
    own: &'a dynid_config::config::LogConfig,
    columns: &'a MappingSpec,
    /// Whether these columns are those of all logs of the run, which need not measure the same.
    shared: bool,
    /// Joints that have positions.
    joints: &'a [LogAxis],
    /// Rows with positions.
    rows: usize,
    warnings: Vec<String>,
    without: Vec<(Channel, Error)>,
}

impl Measurements<'_> {
    /// Efforts, joint after joint; empty where the log has none, or they are not asked for.
    fn effort(&mut self) -> Result<Vec<Vec<f64>>, Error> {
        if !self.config.servo.fit.contains(&ChannelName::Effort) {
            return Ok(Vec::new());
        }
        let columns = (self.columns.effort.clone(), self.columns.current_gains.clone());
        self.signal(Channel::Effort, columns)
    }

    /// Currents, alike. Beside efforts they say little more, and are taken where they are stated.
    fn current(&mut self, alone: bool) -> Result<Vec<Vec<f64>>, Error> {
        let stated = self.config.current.clone();
        if !self.config.servo.fit.contains(&ChannelName::Current) || (stated.is_none() && !alone) {
            return Ok(Vec::new());
        }
        let gains = stated.is_none().then(|| vec![1.0; self.joints.len()]);
        self.signal(Channel::Current, (stated.map(amperes), gains))
    }

    /// Efforts by a mapping; with gains currents that bear the usual names. What is not stated may be missing.
    fn signal(
        &mut self,
        channel: Channel,
        (effort, current_gains): (Option<SignalSpec>, Option<Vec<f64>>),
    ) -> Result<Vec<Vec<f64>>, Error> {
        let stated = effort.is_some() || (current_gains.is_some() && self.columns.current_gains.is_some());
        let axes: Vec<LogAxis> =
            self.joints.iter().map(|a| LogAxis { effort: EffortColumn::Drive, ..a.clone() }).collect();
        let spec = MappingSpec {
            effort,
            current_gains,
            allow_no_effort: !stated,
            allow_unlogged: false,
            ..self.columns.clone()
        };
        if !stated {
            // A look at the names, before the whole file is read again.
            let header = dynid_logs::log::open(&self.own.path, &spec.options(self.own.rows))?.header();
            let (names, efforts): (Vec<String>, Vec<EffortColumn>) =
                axes.iter().map(|a| (a.name.clone(), a.effort)).unzip();
            if ColumnMapping::of_log(&header, &names, &efforts, &spec).is_ok_and(|m| m.effort.is_none()) {
                return Ok(Vec::new());
            }
        }
        match logs::positions(self.own, &axes, &spec) {
            Ok((read, _)) if read.time.len() == self.rows => Ok(read.effort.unwrap_or_default()),
            Ok((read, _)) => {
                self.warnings.push(format!(
                    "{}: efforts in {} of {} rows with positions are left out: `missing = \"interpolate\"` fills the rest",
                    self.file,
                    read.time.len(),
                    self.rows
                ));
                Ok(Vec::new())
            }
            Err(error) if stated && (self.shared || channel == Channel::Current) && is_without(&error) => {
                self.without.push((channel, error));
                Ok(Vec::new())
            }
            Err(error) if stated => Err(error),
            Err(error) => {
                self.warnings.push(format!("{}: what looks like efforts is left out: {error}", self.file));
                Ok(Vec::new())
            }
        }
    }

    fn velocity(&self) -> Result<Vec<Vec<f64>>, Error> {
        if !self.config.servo.fit.contains(&ChannelName::Velocity) {
            return Ok(Vec::new());
        }
        let axes: Vec<LogAxis> =
            self.joints.iter().map(|a| LogAxis { effort: EffortColumn::Absent, ..a.clone() }).collect();
        let spec = MappingSpec {
            effort: None,
            current_gains: None,
            allow_no_effort: true,
            allow_unlogged: false,
            ..self.columns.clone()
        };
        let (read, _) = logs::positions(self.own, &axes, &spec)?;
        // Logs need not all measure them; that none does is refused by the job.
        Ok(read.velocity.filter(|_| read.time.len() == self.rows).unwrap_or_default())
    }
}

/// Whether an error says that a log does not have columns that were stated.
fn is_without(error: &Error) -> bool {
    matches!(error, Error::Columns { source, .. } if matches!(**source, MappingError::UnknownColumn { .. }))
}

/// Columns of currents: in A where nothing else is stated.
fn amperes(spec: SignalSpec) -> SignalSpec {
    let ones = || Some(dynid_logs::columns::PerJoint::One(1.0));
    SignalSpec::Full(match spec {
        SignalSpec::Names(columns) => {
            let unit = Some(dynid_logs::columns::Units::One("A".to_owned()));
            FullSignal { columns, unit, scale: ones(), offset: None }
        }
        SignalSpec::Full(full) => FullSignal { scale: full.scale.clone().or_else(ones), ..full },
    })
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
    log: &dynid_config::config::LogConfig,
    columns: &MappingSpec,
    joints: &[&str],
) -> Result<Option<SignalSpec>, Error> {
    let header = dynid_logs::log::open(&log.path, &columns.options(log.rows))?.header().names;
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
