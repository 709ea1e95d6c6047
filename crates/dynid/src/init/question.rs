//! What logs do not tell.

use dynid_logs::LogFileError;
use dynid_logs::columns::{
    ColumnNames, FullSignal, MappingError, MappingSpec, Signal, SignalSpec, Units, holds_currents,
};
use dynid_logs::log::{DecimalMark, Missing};

use crate::Error;
use crate::robot::Robot;

/// Something that a log does not tell.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Question {
    /// Key under `[columns]` that holds the answer.
    pub key: String,
    /// What is asked.
    pub text: String,
    /// What an answer looks like.
    pub expected: String,
    /// The line to write, with dots in place of the answer.
    pub line: String,
    kind: Kind,
}

#[derive(Debug, Clone, PartialEq, Eq)]
enum Kind {
    Rate,
    Unit(String),
    Names,
    Comma,
    Gains(usize),
    Unlogged,
    Columns(Signal),
}

/// Settles what needs no question, since the configuration says what was done: rows without a value.
pub(super) fn settle(error: &Error, spec: &mut MappingSpec) -> bool {
    let is_missing = |found: &str| found.is_empty() || found.to_lowercase().contains("nan");
    match error {
        Error::LogFile(LogFileError::NotANumber { found, .. } | LogFileError::NotFinite { found, .. })
            if is_missing(found) && spec.missing.is_none() =>
        {
            spec.missing = Some(Missing::Drop);
            true
        }
        Error::Columns { source, .. } => match source.as_ref() {
            MappingError::Sparse { interpolated: false, .. } => {
                spec.missing = Some(Missing::Interpolate);
                true
            }
            _ => false,
        },
        _ => false,
    }
}

/// Columns in a unit.
pub(super) fn in_unit(columns: ColumnNames, unit: &str) -> SignalSpec {
    SignalSpec::Full(FullSignal {
        columns,
        unit: Some(Units::One(unit.to_owned())),
        scale: None,
        offset: None,
    })
}

impl Question {
    /// The question that an error leads to; `None`: no answer would help.
    pub(super) fn about(error: &Error, robot: &Robot) -> Option<Question> {
        let joints: Vec<&str> = robot.axes.iter().map(|a| a.name.as_str()).collect();
        let all = joints.join(", ");
        let question = |key: &str, text: String, expected: &str, line: String, kind| {
            Some(Question { key: key.to_owned(), text, expected: expected.to_owned(), line, kind })
        };
        match error {
            Error::LogFile(LogFileError::AmbiguousComma { found, column, .. }) => question(
                "decimal",
                format!("Is the comma in `{found}` (column `{column}`) the decimal mark? (yes or no)"),
                "yes or no",
                "decimal = \",\"".to_owned(),
                Kind::Comma,
            ),
            Error::Columns { source, .. } => match source.as_ref() {
                MappingError::Missing { signal: Signal::Time, .. } => question(
                    "rate_hz",
                    "No time column was found. Sample rate of the log in Hz?".to_owned(),
                    "a positive number of Hz",
                    "rate_hz = ..".to_owned(),
                    Kind::Rate,
                ),
                MappingError::TimeUnit { column, .. } | MappingError::TimeStep { column, .. } => question(
                    "time",
                    format!("{source}. Unit of `{column}`: s, ms, us or ns?"),
                    "s, ms, us or ns",
                    format!("time = {{ columns = {}, unit = \"..\" }}", super::toml_text::quoted(column)),
                    Kind::Unit(column.clone()),
                ),
                MappingError::Unnamed { columns, reason, .. } => question(
                    "names",
                    format!(
                        "The log has no header ({reason}). Names of its {columns} columns, with commas between (such as t,q1,q2,tau1,tau2)?"
                    ),
                    "one name per column",
                    format!("names = [\"t\", ..]  # {columns} names; joints: {all}"),
                    Kind::Names,
                ),
                MappingError::NoGain { .. } => gains(&all, joints.len()),
                MappingError::Missing { signal: Signal::Effort, header, .. } if holds_currents(header) => {
                    gains(&all, joints.len())
                }
                MappingError::Missing { signal: Signal::Position, joints: without, .. }
                    if without.len() < joints.len() =>
                {
                    let without: Vec<String> =
                        without.iter().map(|j| j.trim_matches('`').to_owned()).collect();
                    question(
                        "allow_unlogged",
                        format!(
                            "There is no position of {}. Is it held at zero throughout the log? (yes or no)",
                            without.join(", ")
                        ),
                        "yes or no",
                        format!("allow_unlogged = true  # {} held at zero", without.join(", ")),
                        Kind::Unlogged,
                    )
                }
                MappingError::Missing { signal, header, .. } => {
                    columns_question(*signal, &format!("No {signal} was found"), header, &all)
                }
                MappingError::Ambiguous { signal: Signal::Time, candidates, .. } => {
                    columns_question(Signal::Time, "Several columns may be the time", candidates, "")
                }
                MappingError::Ambiguous { signal, owner, candidates } => columns_question(
                    *signal,
                    &format!("Several columns may be the {signal} of {owner}"),
                    candidates,
                    &all,
                ),
                _ => None,
            },
            _ => None,
        }
    }

    /// Whether it is an answer: it has the form that is expected, though it may name columns that the log does not have.
    pub fn accepts(&self, answer: &str) -> bool {
        self.take(answer, &mut MappingSpec::default())
    }

    /// Puts an answer into a mapping; false: it is no answer.
    pub(super) fn take(&self, answer: &str, spec: &mut MappingSpec) -> bool {
        let answer = answer.trim().trim_matches('"');
        let list = || answer.split(',').map(str::trim).map(str::to_owned).collect::<Vec<String>>();
        let yes = matches!(answer.to_lowercase().as_str(), "y" | "yes");
        match &self.kind {
            Kind::Rate => match answer.parse::<f64>() {
                Ok(rate) if rate.is_finite() && rate > 0.0 => {
                    (spec.rate_hz, spec.time) = (Some(rate), None);
                    true
                }
                _ => false,
            },
            Kind::Unit(column) => {
                let known = ["s", "ms", "us", "ns"].contains(&answer);
                if known {
                    spec.time = Some(in_unit(ColumnNames::Pattern(column.clone()), answer));
                }
                known
            }
            Kind::Names => {
                spec.names = Some(list());
                true
            }
            Kind::Comma => {
                if yes {
                    spec.decimal = Some(DecimalMark::Comma);
                }
                yes
            }
            Kind::Gains(count) => {
                let gains: Result<Vec<f64>, _> = list().iter().map(|x| x.parse::<f64>()).collect();
                match gains {
                    Ok(gains)
                        if gains.len() == *count && gains.iter().all(|g| g.is_finite() && *g != 0.0) =>
                    {
                        spec.current_gains = Some(gains);
                        true
                    }
                    _ => false,
                }
            }
            Kind::Unlogged => {
                spec.allow_unlogged |= yes;
                yes
            }
            Kind::Columns(signal) => {
                let names = match list() {
                    one if one.len() == 1 => ColumnNames::Pattern(answer.to_owned()),
                    several => ColumnNames::List(several),
                };
                *place(spec, *signal) = Some(SignalSpec::Names(names));
                true
            }
        }
    }

    /// Lets the reading go on without an answer; false: it cannot.
    pub(super) fn stand_in(&self, spec: &mut MappingSpec) -> bool {
        match &self.kind {
            Kind::Rate => {
                (spec.rate_hz, spec.time) = (Some(100.0), None);
                true
            }
            Kind::Unlogged => {
                spec.allow_unlogged = true;
                true
            }
            Kind::Gains(count) if spec.current_gains.is_none() => {
                spec.current_gains = Some(vec![1.0; *count]);
                true
            }
            _ => false,
        }
    }
}

fn gains(joints: &str, count: usize) -> Option<Question> {
    Some(Question {
        key: "current_gains".to_owned(),
        text: format!("The log holds motor currents. Drive gains in N m/A of {joints}, with commas between?"),
        expected: format!("{count} numbers that are not zero"),
        line: format!("current_gains = [..]  # N m/A of {joints}"),
        kind: Kind::Gains(count),
    })
}

fn columns_question(signal: Signal, what: &str, header: &[String], joints: &str) -> Option<Question> {
    let shown: Vec<&str> = header.iter().take(40).map(String::as_str).collect();
    let (how, of) = match signal {
        Signal::Time => (String::new(), String::new()),
        _ => (
            " as a pattern ({} counts the joints, {joint} is the name of one) or one by one with commas between".to_owned(),
            format!("  # {joints}"),
        ),
    };
    Some(Question {
        key: signal.to_string(),
        text: format!("{what}. Which column{how}? There are {}", shown.join(", ")),
        expected: "names of columns".to_owned(),
        line: format!("{signal} = \"..\"{of}"),
        kind: Kind::Columns(signal),
    })
}

fn place(spec: &mut MappingSpec, signal: Signal) -> &mut Option<SignalSpec> {
    match signal {
        Signal::Time => &mut spec.time,
        Signal::Position => &mut spec.position,
        Signal::Velocity => &mut spec.velocity,
        Signal::Acceleration => &mut spec.acceleration,
        Signal::Effort => &mut spec.effort,
        Signal::Temperature => &mut spec.temperature,
    }
}
