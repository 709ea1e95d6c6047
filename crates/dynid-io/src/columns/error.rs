//! Faults of the mapping from columns to signals.

use thiserror::Error;

use super::Signal;
use crate::excerpt::listed;

/// Most names repeated in a message.
const LISTED: usize = 16;

/// Why the columns of a log could not be assigned.
#[derive(Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum MappingError {
    /// No column holds a signal.
    #[error(
        "{signal} of {}: expected one of the columns {}, found {}",
        listed(joints, LISTED),
        listed(looked_for, LISTED),
        listed(header, LISTED)
    )]
    Missing {
        /// Signal.
        signal: Signal,
        /// Joints without it; empty for time.
        joints: Vec<String>,
        /// Names that were looked for.
        looked_for: Vec<String>,
        /// Names there are.
        header: Vec<String>,
    },
    /// Several columns could be the signal.
    #[error("{signal} of {owner}: expected one column, found {}", listed(candidates, LISTED))]
    Ambiguous {
        /// Signal.
        signal: Signal,
        /// Joint, or `the log`.
        owner: String,
        /// Columns.
        candidates: Vec<String>,
    },
    /// One column was given two meanings.
    #[error("column `{column}`: expected one signal, found {first} and {second}")]
    Shared {
        /// Column.
        column: String,
        /// First meaning.
        first: String,
        /// Second meaning.
        second: String,
    },
    /// The mapping names a column that the log does not have.
    #[error("{signal}: expected the column `{column}`, found {}", listed(header, LISTED))]
    UnknownColumn {
        /// Signal or channel.
        signal: String,
        /// Column.
        column: String,
        /// Names there are.
        header: Vec<String>,
        /// A close name.
        meant: Option<String>,
    },
    /// The mapping names a joint that the robot does not have.
    #[error("{signal}: expected a joint of the robot, found `{joint}`")]
    UnknownJoint {
        /// Signal.
        signal: Signal,
        /// Joint.
        joint: String,
        /// A close name.
        meant: Option<String>,
    },
    /// A unit that the signal cannot have.
    #[error("{signal}, column `{column}`: expected a unit among {expected}, found `{unit}`")]
    Unit {
        /// Signal.
        signal: Signal,
        /// Column.
        column: String,
        /// Unit.
        unit: String,
        /// Units there are.
        expected: &'static str,
    },
    /// Effort as current without drive gains.
    #[error("effort, column `{column}`: expected drive gains for a current, found none")]
    NoGain {
        /// Column.
        column: String,
    },
    /// Two settings of which one would do nothing.
    #[error("{key}: expected no value beside {beside}")]
    Idle {
        /// The setting that would do nothing.
        key: &'static str,
        /// What takes its place.
        beside: String,
    },
    /// A column for the effort of a joint on which no drive acts.
    #[error("effort of `{joint}`: expected no column (no drive acts on it), found `{column}`")]
    Undriven {
        /// Joint.
        joint: String,
        /// Column.
        column: String,
    },
    /// A list whose length is not the number of joints.
    #[error("{signal}: {what}: expected {expected} entries (one per joint), found {found}")]
    Count {
        /// Signal.
        signal: Signal,
        /// What was counted.
        what: &'static str,
        /// Joints.
        expected: usize,
        /// Entries.
        found: usize,
    },
    /// A number that is not usable.
    #[error("{owner}: {what}: expected {expected}, found {found}")]
    Number {
        /// Signal or table.
        owner: String,
        /// Name of the number.
        what: &'static str,
        /// What is required.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// A converted value overflows.
    #[error(
        "{signal}, column `{column}`, row {row}: expected a finite number after conversion, found {found}"
    )]
    Overflow {
        /// Signal.
        signal: String,
        /// Column.
        column: String,
        /// Data row of the table, from 1.
        row: usize,
        /// The value.
        found: f64,
    },
}

impl MappingError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        use MappingError as E;
        Some(match self {
            E::Idle { key: "current_gains", .. } => {
                "gains (`--gains`, `current_gains`) are for current columns that are found by name: leave them out, or state \
                 `effort = { columns = \"i{}\", unit = \"A\", scale = [..] }`"
                    .to_owned()
            }
            E::Idle { .. } => "leave out one of the two".to_owned(),
            E::Missing { signal: Signal::Time, .. } => {
                "name the time column in the mapping, or give the sampling rate (`rate_hz`)".to_owned()
            }
            E::Missing { signal: Signal::Position, .. } => {
                "name the columns in the mapping; joints without a log (such as grippers) need `allow_unlogged`"
                    .to_owned()
            }
            E::Missing { signal: Signal::Effort, header, .. }
                if header.iter().any(|h| h.starts_with(['i', 'I'])) =>
            {
                "name the effort columns in the mapping; motor currents need drive gains, N m/A".to_owned()
            }
            E::Missing { .. } => "name the columns in the mapping".to_owned(),
            E::Ambiguous { .. } | E::Shared { .. } => "say which one in the mapping".to_owned(),
            E::UnknownColumn { meant: Some(name), .. } | E::UnknownJoint { meant: Some(name), .. } => {
                format!("did you mean `{name}`?")
            }
            E::UnknownColumn { .. } => "use the names of the log's header".to_owned(),
            E::UnknownJoint { .. } => "use the joint names of the robot file".to_owned(),
            E::Unit { .. } => "correct the unit in the mapping or in the header's brackets".to_owned(),
            E::NoGain { .. } => "give `scale` in N m/A (or `current_gains`), one number per joint".to_owned(),
            E::Undriven { .. } => {
                "the drive of an elastic joint acts on its motor: name the column as the motor's, `effort = { <motor> = \"..\" }`; \
                 a torque sensor behind the transmission is said by `sensor = true` in the robot file"
                    .to_owned()
            }
            E::Count { .. } => "one entry per joint in joint order; an empty name stands for `not logged`".to_owned(),
            E::Number { .. } => "correct the number in the mapping".to_owned(),
            E::Overflow { .. } => "check unit, scale and offset of the column".to_owned(),
        })
    }
}
