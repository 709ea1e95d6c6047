//! Faults of the mapping from columns to signals.

use dynid_files::excerpt::listed;
use thiserror::Error;

use super::Signal;

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
        /// The names that look most like it.
        nearest: Vec<String>,
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
    /// Columns that are added up to a time, one of which does not say what it counts.
    #[error("time, column `{column}`: expected a unit, since columns of the time are added up, found none")]
    PartOfTime {
        /// Column.
        column: String,
    },
    /// A time whose unit its numbers leave open.
    #[error("time, column `{column}`: expected a unit, found steps of {}: {}", short(*step), rates(units))]
    TimeUnit {
        /// Column.
        column: String,
        /// Usual step, as in the file.
        step: f64,
        /// Units that make sense with the sample rates that follow, Hz.
        units: Vec<(&'static str, f64)>,
    },
    /// A time in whose unit no log is sampled.
    #[error("time, column `{column}`: expected steps of a sampled log, found steps of {} {unit}", short(*step))]
    TimeStep {
        /// Column.
        column: String,
        /// Usual step, as in the file.
        step: f64,
        /// Unit that was said or assumed.
        unit: String,
        /// The unit that makes sense of it.
        meant: Option<&'static str>,
    },
    /// A signal without a value in a row.
    #[error("column `{column}`, row {row}: expected a value, found none")]
    NoValue {
        /// Column.
        column: String,
        /// Data row, from 1.
        row: usize,
    },
    /// Hardly any row has all signals.
    #[error(
        "column `{column}`: expected a value in most of the {positioned} rows with positions, found all signals in {rows} of them"
    )]
    Sparse {
        /// The column that lacks most.
        column: String,
        /// Rows with all signals.
        rows: usize,
        /// Rows with positions.
        positioned: usize,
        /// Gaps were interpolated already.
        interpolated: bool,
    },
    /// A log without a header whose numbers do not tell what its columns are.
    #[error("expected column names, found numbers in the first line and {columns} columns: {reason}")]
    Unnamed {
        /// Columns.
        columns: usize,
        /// Joints of the robot.
        joints: usize,
        /// Why they are not told.
        reason: String,
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

/// A number with six digits.
fn short(x: f64) -> f64 {
    format!("{x:.5e}").parse().unwrap_or(x)
}

/// `5 Hz in s, 5000 Hz in ms`.
fn rates(units: &[(&'static str, f64)]) -> String {
    units.iter().map(|(unit, rate)| format!("{rate:.4} Hz in {unit}")).collect::<Vec<_>>().join(", ")
}

/// A line of a configuration that names the columns of a signal: for few joints one by one, for many as a pattern.
fn line(signal: Signal, joints: &[String]) -> String {
    // Messages put names between backticks.
    let bare: Vec<&str> = joints.iter().map(|j| j.trim_matches('`')).collect();
    match bare.as_slice() {
        [] => format!("{signal} = \"..\""),
        few if few.len() <= 3 => {
            let entries: Vec<String> = few.iter().map(|joint| format!("\"{joint}\" = \"..\"")).collect();
            format!("{signal} = {{ {} }}", entries.join(", "))
        }
        _ => format!("{signal} = \"..{{}}\" ({{}} counts the joints, {{joint}} is the name of one)"),
    }
}

impl MappingError {
    /// What to do about it, with the line to write.
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
                "name the time column under [columns], `time = { columns = \"..\", unit = \"s\" }`, or give the sample rate, \
                 `rate_hz = 500` (`--rate-hz 500`)"
                    .to_owned()
            }
            E::Missing { signal: Signal::Position, joints, .. } => format!(
                "name the columns under [columns]: `{}`; joints without a log (such as grippers) need `allow_unlogged = true` \
                 (`--allow-unlogged`)",
                line(Signal::Position, joints)
            ),
            E::Missing { signal: Signal::Effort, header, .. } if holds_currents(header) => {
                "motor currents need drive gains, N m/A, one per joint: `current_gains = [..]` under [columns] (`--gains K1,K2,..`), \
                 or name the effort columns, `effort = \"..{}\"`"
                    .to_owned()
            }
            E::Missing { signal, joints, .. } => {
                format!("name the columns under [columns]: `{}`", line(*signal, joints))
            }
            E::Ambiguous { signal: Signal::Time, candidates, .. } => format!(
                "say which one under [columns]: `time = \"{}\"`, or leave the others alone: `ignore = [\"..\"]`",
                candidates.first().map_or("..", String::as_str)
            ),
            E::Ambiguous { signal, owner, candidates } => format!(
                "say which one under [columns]: `{signal} = {{ \"{}\" = \"{}\", .. }}` or a pattern such as `\"..{{joint}}..\"`, or leave \
                 the others alone: `ignore = [\"..\"]`",
                owner.trim_matches('`'),
                candidates.first().map_or("..", String::as_str)
            ),
            E::Shared { .. } => "say which one under [columns], such as `effort = \"tau{}\"`".to_owned(),
            E::UnknownColumn { nearest, .. } if !nearest.is_empty() => {
                format!("did you mean `{}`?", nearest.join("`, `"))
            }
            E::UnknownJoint { meant: Some(name), .. } => format!("did you mean `{name}`?"),
            E::UnknownColumn { .. } => "use the names of the log's header".to_owned(),
            E::UnknownJoint { .. } => "use the joint names of the robot file".to_owned(),
            E::Unit { signal, column, .. } => format!(
                "correct the unit: `{signal} = {{ columns = \"{column}\", unit = \"..\" }}` under [columns], or in the header's brackets"
            ),
            E::NoGain { .. } => "give `scale` in N m/A (or `current_gains = [..]`, `--gains`), one number per joint".to_owned(),
            E::Undriven { .. } => {
                "the drive of an elastic joint acts on its motor: name the column as the motor's, `effort = { <motor> = \"..\" }`; \
                 a torque sensor behind the transmission is said by `sensor = true` in the robot file"
                    .to_owned()
            }
            E::Count { .. } => "one entry per joint in joint order; an empty name stands for `not logged`".to_owned(),
            E::Number { .. } => "correct the number under [columns]".to_owned(),
            E::PartOfTime { .. } => {
                "state them: `time = { columns = [\"sec\", \"nanosec\"], unit = \"s\", scale = [1.0, 1e-9] }` under [columns]".to_owned()
            }
            E::TimeUnit { column, units, .. } => {
                let unit = units.first().map_or("s", |(unit, _)| unit);
                format!("state it under [columns]: `time = {{ columns = \"{column}\", unit = \"{unit}\" }}`")
            }
            E::TimeStep { column, meant: Some(unit), .. } => {
                format!("state the unit under [columns]: `time = {{ columns = \"{column}\", unit = \"{unit}\" }}`")
            }
            E::TimeStep { column, .. } => format!(
                "state the unit under [columns], `time = {{ columns = \"{column}\", unit = \"..\" }}`, or the sample rate, `rate_hz = 500`"
            ),
            E::NoValue { .. } => "`missing = \"drop\"` under [columns] (or `--missing drop`) leaves such rows out".to_owned(),
            E::Sparse { interpolated: false, .. } => {
                "topics with stamps of their own have no rows in common: `missing = \"interpolate\"` under [columns] (`--missing interpolate`)"
                    .to_owned()
            }
            E::Sparse { column, .. } => {
                format!("the signal is silent most of the time: leave it out, `ignore = [\"{column}\"]`, or record it faster")
            }
            E::Unnamed { joints, .. } => {
                let numbered = |name: &str| (1..=(*joints).min(2)).map(|k| format!("\"{name}{k}\"")).collect::<Vec<_>>().join(", ");
                format!(
                    "name all columns in their order under [columns]: `names = [\"t\", {}, .., {}, ..]` (`--names t,q1,..`), or add a first line",
                    numbered("q"),
                    numbered("tau")
                )
            }
            E::Overflow { .. } => "check unit, scale and offset of the column".to_owned(),
        })
    }
}

/// Whether a header has columns that look like motor currents.
/// Whether some column looks like a motor current: `current` in its name, or `i` and a number (`i1`, `I_1`).
pub fn holds_currents(header: &[String]) -> bool {
    let is_numbered = |name: &str| {
        let number = name.strip_prefix('i').map(|rest| rest.strip_prefix('_').unwrap_or(rest));
        number.is_some_and(|n| !n.is_empty() && n.bytes().all(|b| b.is_ascii_digit()))
    };
    header.iter().map(|name| name.to_lowercase()).any(|name| name.contains("current") || is_numbered(&name))
}
