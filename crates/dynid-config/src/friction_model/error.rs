//! What keeps friction experiments from being evaluated.

use dynid_friction::steady_friction::SteadyError;
use dynid_identify::{Error, Fault};
use dynid_motion::ClockError;
use dynid_motion::constant_speed::ConstantSpeedError;
use thiserror::Error as ThisError;

/// Bad input of friction experiments; [`FrictionError::hint`] says what to do about it.
#[derive(Debug, ThisError)]
#[non_exhaustive]
pub enum FrictionError {
    /// No log has a stretch of constant speed.
    #[error(
        "{file}{}: expected stretches of constant speed of {least_duration_s} s or more{}, found none",
        if *logs > 1 { format!(" and {} other logs", logs - 1) } else { String::new() },
        joint.as_ref().map_or_else(String::new, |j| format!(" of joint `{j}`"))
    )]
    NoConstantSpeed {
        /// First log.
        file: String,
        /// Number of logs.
        logs: usize,
        /// Joint asked for.
        joint: Option<String>,
        /// Least duration, s.
        least_duration_s: f64,
    },
    /// Thermal lines are asked for, but a log has no temperature.
    #[error(
        "{file}: joint `{joint}`: expected a temperature column, since thermal lines are required, found none"
    )]
    NoTemperature {
        /// Log.
        file: String,
        /// Joint.
        joint: String,
    },
    /// Thermal lines are asked for, but the temperatures do not allow them.
    #[error("joint `{joint}`: thermal lines are required: {reason}")]
    NoLines {
        /// Joint.
        joint: String,
        /// Why there are none.
        reason: String,
    },
    /// Signals of a log are refused.
    #[error(transparent)]
    ConstantSpeed(#[from] ConstantSpeedError),
    /// The clock of a log is refused.
    #[error("{file}: {source}")]
    Clock {
        /// Log.
        file: String,
        /// Why.
        source: ClockError,
    },
    /// The law that was asked for has no fit.
    #[error("joint `{joint}`: {source}")]
    Law {
        /// Joint.
        joint: String,
        /// Why.
        source: SteadyError,
    },
    /// A pre-sliding log of a joint whose steady friction is not known.
    #[error("{file}: joint `{joint}`: expected its steady friction from a `[[log]]`, found none")]
    NoSteadyLaw {
        /// Log.
        file: String,
        /// Joint.
        joint: String,
    },
    /// The search of bristles cannot run.
    #[error("pre-sliding: {0}")]
    Search(#[from] dynid_search::SearchError),
    /// A friction file is none.
    #[error("{file}: not a friction model: {message}")]
    File {
        /// File.
        file: String,
        /// What is wrong.
        message: String,
    },
}

impl From<FrictionError> for Error {
    fn from(fault: FrictionError) -> Self {
        Error::Job(Box::new(fault))
    }
}

impl Fault for FrictionError {
    fn hint(&self) -> Option<String> {
        Some(
            match self {
                FrictionError::NoConstantSpeed { .. } => {
                    "record passes at constant speed with one joint at a time, forth and back; `[constant_speed]` sets what \
                     counts as constant; `signal = \"friction\"` takes friction signals of any motion"
                }
                FrictionError::NoTemperature { .. } => {
                    "name the columns under [columns] temperature, or leave out `thermal_lines`: the law then holds for \
                     the temperature of the test"
                }
                FrictionError::NoLines { .. } => "record the same speeds at temperatures at least 5 K apart",
                FrictionError::Clock { .. } => {
                    "check the time column; `rate_hz` in [columns] states a sample rate instead"
                }
                FrictionError::NoSteadyLaw { .. } => {
                    "add logs at constant speed of this joint: bristles are found on top of its steady friction"
                }
                FrictionError::Law { .. } => "leave out `law`, or record more speeds",
                FrictionError::File { .. } => "a friction model is the friction.json that `dynid friction` writes",
                _ => return None,
            }
            .to_owned(),
        )
    }
}
