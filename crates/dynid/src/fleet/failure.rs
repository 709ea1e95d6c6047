//! Logs that could not be reduced, as results.

use dynid_record::words;
use serde::{Deserialize, Serialize};

use crate::Error;

/// A log that could not be reduced.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Failure {
    /// The log, as the manifest states it.
    pub log: String,
    /// Its robot.
    pub robot: String,
    /// Which kind of fault.
    pub code: FailureCode,
    /// What is wrong.
    pub message: String,
    /// What can be done about it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hint: Option<String>,
    /// Which log it is by its content, by which recipe and how read; absent where nothing was read, so that the log may be well another time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub id: Option<String>,
}

words! {
    /// Kinds of faults of logs.
    FailureCode {
        /// The file is not there, or cannot be opened.
        Unreadable = "unreadable",
        /// Columns, units or numbers are not what a log has.
        Malformed = "malformed",
        /// The pre-flight refuses the log: nonsense would come of it.
        Preflight = "preflight",
        /// Another sample rate, or a joint without a column: not a log of this recipe.
        RecipeMismatch = "recipe_mismatch",
        /// Nothing is left of the log behind kernel and mask.
        NoRows = "no_rows",
        /// A fault of the program.
        Internal = "internal",
        /// The process that had the log, and no other, ended without a result.
        WorkerLost = "worker_lost",
        /// The factors of the log cannot be read.
        Damaged = "damaged",
        /// The same log is stated for several robots.
        TwoRobots = "two_robots",
    }
}

impl FailureCode {
    fn of(error: &Error) -> FailureCode {
        use crate::reduce::ReductionError as Reduction;
        match error {
            Error::Read { .. } => FailureCode::Unreadable,
            Error::Reduction(Reduction::Rate { .. } | Reduction::NotLogged { .. }) => {
                FailureCode::RecipeMismatch
            }
            Error::Reduction(Reduction::NoRows { .. }) => FailureCode::NoRows,
            Error::PreflightFault(_) => FailureCode::Preflight,
            _ => FailureCode::Malformed,
        }
    }
}

impl Failure {
    /// What an error means for a log of a robot.
    pub fn of(log: &str, robot: &str, error: &Error) -> Failure {
        Failure {
            log: log.to_owned(),
            robot: robot.to_owned(),
            code: FailureCode::of(error),
            message: error.to_string(),
            hint: error.hint(),
            id: None,
        }
    }

    /// A fault of the program.
    pub(super) fn internal(log: &str, robot: &str) -> Failure {
        Failure {
            log: log.to_owned(),
            robot: robot.to_owned(),
            code: FailureCode::Internal,
            message: format!("{log}: internal fault"),
            hint: Some("please report it with the log".to_owned()),
            id: None,
        }
    }

    /// The file of a failure.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).unwrap_or_else(|e| unreachable!("plain data: {e}"))
    }

    /// Whether the log may be well another time: nothing is known of its content.
    pub(super) fn may_pass(&self) -> bool {
        self.id.is_none() && !matches!(self.code, FailureCode::Damaged | FailureCode::TwoRobots)
    }
}
