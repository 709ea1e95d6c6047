//! Names by which logs call their signals.

use std::fmt;

/// A kind of column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// Time.
    Time,
    /// Joint position.
    Position,
    /// Joint velocity.
    Velocity,
    /// Joint acceleration.
    Acceleration,
    /// Joint effort.
    Effort,
    /// Temperature of the joint.
    Temperature,
}

impl fmt::Display for Signal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Signal::Time => "time",
            Signal::Position => "position",
            Signal::Velocity => "velocity",
            Signal::Acceleration => "acceleration",
            Signal::Effort => "effort",
            Signal::Temperature => "temperature",
        })
    }
}

/// Names of time columns.
pub(crate) const TIME_NAMES: [&str; 5] = ["t", "time", "timestamp", "stamp", "header.stamp"];

/// Names of a signal in groups; a group is looked at only if the ones before it matched nothing.
pub(crate) fn names(signal: Signal) -> &'static [&'static [&'static str]] {
    match signal {
        Signal::Time => &[&TIME_NAMES],
        Signal::Position => &[
            &[
                "q",
                "pos",
                "position",
                "joint_position",
                "positions",
                "joint_positions",
                "measured_joint_position",
                "joint_position_measured",
            ],
            &["qm", "motor_position"],
        ],
        Signal::Velocity => &[&[
            "dq",
            "qd",
            "v",
            "vel",
            "velocity",
            "joint_velocity",
            "velocities",
            "joint_velocities",
            "joint_velocity_estimated",
        ]],
        Signal::Acceleration => {
            &[&["ddq", "qdd", "a", "acc", "acceleration", "joint_acceleration", "accelerations"]]
        }
        Signal::Effort => &[
            &[
                "tau",
                "effort",
                "torque",
                "joint_torque",
                "joint_effort",
                "efforts",
                "torques",
                "joint_torques",
                "joint_efforts",
                "measured_torque",
                "joint_torque_measured",
            ],
            &["u"],
        ],
        Signal::Temperature => &[&["temp", "temperature", "t", "temperatures"]],
    }
}

/// Names of motor currents, used for effort if drive gains are given.
pub(crate) const CURRENT_NAMES: [&str; 4] = ["i", "im", "current", "motor_current"];

/// A column name taken apart: `Q1 [deg]` has stem `q1` and unit `deg`.
pub(crate) struct ColumnName<'a> {
    pub(crate) raw: &'a str,
    /// Possible readings: the whole name, and for `time_ms` also without the unit.
    readings: Vec<(String, Option<&'a str>)>,
    /// Ends of a path such as `/joint_states/j1/position`: `joint_states/j1/position`, `j1/position`, `position`.
    ends: Vec<String>,
}

/// Units that may follow a name after `_`.
const SUFFIX_UNITS: [&str; 20] = [
    "s", "sec", "ms", "us", "ns", "rad", "deg", "rev", "m", "mm", "rads", "rpm", "nm", "mnm", "n", "a", "ma",
    "c", "degc", "k",
];

impl<'a> ColumnName<'a> {
    pub(crate) fn new(raw: &'a str) -> Self {
        let name = raw.trim();
        let bracketed = name
            .strip_suffix(']')
            .and_then(|n| n.rsplit_once('['))
            .or_else(|| name.strip_suffix(')').and_then(|n| n.rsplit_once('(')))
            .filter(|(stem, inner)| !stem.is_empty() && !inner.trim().bytes().all(|b| b.is_ascii_digit()));
        let readings = match bracketed {
            Some((stem, unit)) => vec![(stem.trim().trim_end_matches('_').to_lowercase(), Some(unit.trim()))],
            None => {
                let mut readings = vec![(name.to_lowercase(), None)];
                if let Some((stem, unit)) = name.rsplit_once('_')
                    && SUFFIX_UNITS.contains(&unit.to_lowercase().as_str())
                {
                    readings.push((stem.to_lowercase(), Some(unit)));
                }
                readings
            }
        };
        let lower = name.to_lowercase();
        let ends = lower.match_indices('/').map(|(k, _)| lower[k + 1..].to_owned()).collect();
        ColumnName { raw, readings, ends }
    }

    /// The unit of the first reading that `accept` takes; `Some(None)`: taken, no unit.
    pub(crate) fn reading(&self, accept: impl Fn(&str) -> bool) -> Option<Option<&'a str>> {
        self.readings.iter().find(|(stem, _)| accept(stem)).map(|(_, unit)| *unit)
    }

    /// As [`ColumnName::reading`], also for the end of a path.
    pub(crate) fn reading_of_path(&self, accept: impl Fn(&str) -> bool) -> Option<Option<&'a str>> {
        self.reading(&accept).or_else(|| self.ends.iter().any(|end| accept(end)).then_some(None))
    }
}

/// The unit of a part of a time, by names such as `header.stamp.sec` and `stamp_nanosec`, and what stands before it.
pub(crate) fn part_of_time(column: &str) -> Option<(&str, &'static str)> {
    let column = column.trim();
    let at = column.rfind(['.', '/', '_']).map_or(0, |k| k + 1);
    let (before, part) = column.split_at(at);
    let unit = match part.to_lowercase().as_str() {
        "sec" | "secs" | "seconds" => "s",
        "nanosec" | "nanosecs" | "nsec" | "nsecs" | "nanoseconds" => "ns",
        _ => return None,
    };
    Some((before, unit))
}

/// True if a log's column of this name holds times: `t`, `Time`, `timestamp [ns]`, `time_ms`, ...
pub fn is_time_name(column: &str) -> bool {
    ColumnName::new(column).reading(|stem| TIME_NAMES.contains(&stem)).is_some()
}

/// What a column's name says that it holds, whatever joint it is of: `q_arm`, `/joint_states/arm/velocity`, `tau[3]`.
pub fn signal_of_name(column: &str) -> Option<Signal> {
    let name = ColumnName::new(column);
    let means = |signal: Signal| {
        let of_joint = |stem: &str, word: &str| {
            let beside = |rest: &str| rest.starts_with(['_', '.', '/', ' ', '-']) && rest.len() > 1;
            let behind = |rest: &str| rest.ends_with(['_', '.', '/', ' ', '-']) && rest.len() > 1;
            // Single letters begin and end too many words.
            let is_word = word.len() > 1 || signal == Signal::Position;
            stem == word
                || number_of(stem, word).is_some()
                || (is_word && stem.strip_prefix(word).is_some_and(beside))
                || (is_word && stem.strip_suffix(word).is_some_and(behind))
        };
        let words = names(signal).iter().flat_map(|group| group.iter());
        words.into_iter().any(|word| name.reading_of_path(|stem| of_joint(stem, word)).is_some())
    };
    let signals = [
        Signal::Time,
        Signal::Position,
        Signal::Velocity,
        Signal::Acceleration,
        Signal::Effort,
        Signal::Temperature,
    ];
    match is_time_name(column) {
        true => Some(Signal::Time),
        false => signals.into_iter().skip(1).find(|signal| means(*signal)),
    }
}

/// True if a part of a column's path says that it was asked of the robot, or formed of that.
pub(crate) fn is_command(column: &str) -> bool {
    let words = [
        "action",
        "command",
        "commands",
        "desired",
        "error",
        "goal",
        "joint_trajectory",
        "output",
        "reference",
        "setpoint",
        "target",
    ];
    column.to_lowercase().split(['/', '.']).any(|part| words.contains(&part))
}

/// Whether a column holds from one of its values to the next, as what is asked of a robot does (a part of its path says so: `command`,
/// `reference`, `joint_trajectory`, ..). Measurements go on between their values; so do errors, which are made of them.
pub fn is_held(column: &str) -> bool {
    is_command(column) && !column.to_lowercase().split(['/', '.']).any(|part| part == "error")
}

/// True if `stem` means `name` of the joint: `q_arm`, `arm_q`, `arm.q`, `q.arm`, ...
pub(crate) fn names_joint(stem: &str, name: &str, joint: &str) -> bool {
    let joint = joint.to_lowercase();
    let separated = |first: &str, second: &str| {
        stem.strip_prefix(first)
            .and_then(|rest| rest.strip_suffix(second))
            .is_some_and(|between| matches!(between, "_" | "." | "/" | " " | "-"))
    };
    separated(name, &joint) || separated(&joint, name)
}

/// The number in `q3`, `q_3`, `q[3]`, `q(3)`, `q.3`.
pub(crate) fn number_of(stem: &str, name: &str) -> Option<usize> {
    let rest = stem.strip_prefix(name)?;
    let digits = rest
        .strip_prefix('[')
        .and_then(|r| r.strip_suffix(']'))
        .or_else(|| rest.strip_prefix('(').and_then(|r| r.strip_suffix(')')))
        .or_else(|| rest.strip_prefix(['_', '.', ' ']))
        .unwrap_or(rest);
    if digits.is_empty() || !digits.bytes().all(|b| b.is_ascii_digit()) {
        return None;
    }
    digits.parse().ok()
}
