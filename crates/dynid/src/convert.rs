//! Logs written in other formats: all of their numbers, or the signals of a robot in SI.

use std::path::Path;

use dynid_files::OutputError;
use dynid_logs::table_file::{self, Column, JointStates, TableFormat};
use dynid_logs::{MappingSpec, ReadingNote, Signals};

use crate::Error;
use crate::config::LogConfig;
use crate::logs;
use crate::robot::Robot;

/// A log that was read and waits to be written.
#[derive(Debug)]
pub struct Converted {
    /// Names of its columns.
    pub names: Vec<String>,
    /// Its columns.
    pub columns: Vec<Column>,
    /// What was found out about reading it.
    pub notes: Vec<ReadingNote>,
    /// Signals of the robot's joints, if there is a robot.
    joints: Option<JointStates>,
}

/// Reads a log. Without a robot its columns stay as they are, but for those that hold texts; with one they are `t` in s, `q_<joint>`,
/// `dq_<joint>`, `ddq_<joint>`, `tau_<joint>` in SI, `temperature_<joint>` in °C, and the channels that `columns` states.
///
/// # Errors
/// As the reading of logs ([`logs::load`]).
pub fn convert(log: &LogConfig, columns: &MappingSpec, robot: Option<&Robot>) -> Result<Converted, Error> {
    let Some(robot) = robot else {
        let logs::WholeTable { table, notes, .. } = logs::table(log, columns)?;
        let whole = |(values, origin): (Vec<f64>, &i64)| match origin {
            0 => Column::Float(values),
            _ if values.iter().all(|x| x.fract() == 0.0) => {
                Column::Whole(values.iter().map(|x| origin.saturating_add(*x as i64)).collect())
            }
            _ => Column::Float(values.iter().map(|x| x + *origin as f64).collect()),
        };
        let columns = table.columns.into_iter().zip(&table.origin).map(whole).collect();
        return Ok(Converted { names: table.header, columns, notes, joints: None });
    };
    let (signals, notes) = logs::recorded(log, &robot.axes, columns)?;
    Ok(of_signals(signals, notes))
}

fn of_signals(signals: Signals, notes: Vec<ReadingNote>) -> Converted {
    let (mut names, mut columns) = (vec!["t".to_owned()], vec![Column::Float(signals.time.clone())]);
    let mut put = |name: String, values: &[f64]| {
        names.push(name);
        columns.push(Column::Float(values.to_vec()));
    };
    let joints = &signals.joints;
    let lists = [
        ("q", Some(&signals.position)),
        ("dq", signals.velocity.as_ref()),
        ("ddq", signals.acceleration.as_ref()),
        ("tau", signals.effort.as_ref()),
    ];
    for (symbol, list) in lists {
        for (joint, values) in joints.iter().zip(list.into_iter().flatten()) {
            put(format!("{symbol}_{joint}"), values);
        }
    }
    for (joint, values) in joints.iter().zip(signals.temperature.iter().flatten()) {
        if let Some(values) = values {
            put(format!("temperature_{joint}"), values);
        }
    }
    for (name, values) in &signals.channels {
        put(name.clone(), values);
    }
    // The whole seconds of the first stamp keep their digits apart from the rest.
    let whole = signals.time_origin.trunc();
    let rest = signals.time_origin - whole;
    let stamp = |t: &f64| {
        (whole as i64).saturating_mul(1_000_000_000).saturating_add(((t + rest) * 1e9).round() as i64)
    };
    let states = JointStates {
        joints: signals.joints,
        stamps: signals.time.iter().map(stamp).collect(),
        position: signals.position,
        velocity: signals.velocity.unwrap_or_default(),
        effort: signals.effort.unwrap_or_default(),
    };
    Converted { names, columns, notes, joints: Some(states) }
}

impl Converted {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Column::rows)
    }

    /// Writes it; the format is told by the end of the name ([`TableFormat`]).
    ///
    /// # Errors
    /// [`OutputError`]; of `.mcap` without a robot too, whose messages need joints.
    pub fn write(&self, path: &Path) -> Result<(), OutputError> {
        match (TableFormat::of(path), &self.joints) {
            (Some(TableFormat::Mcap), Some(states)) => table_file::write_joint_states(path, states),
            (Some(TableFormat::Mcap), None) => Err(OutputError::Format {
                file: path.display().to_string(),
                expected: "a robot, whose joint states `.mcap` holds,",
                found: "none".to_owned(),
            }),
            _ => table_file::write(path, &self.names, &self.columns),
        }
    }
}
