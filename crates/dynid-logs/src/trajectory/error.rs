//! Faults of trajectory files.

use dynid_files::text::TextFault;
use dynid_motion::trajectory::TrajectoryError;
use thiserror::Error;

use crate::csv::LogFileError;

/// Why a trajectory file was refused.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TrajectoryFileError {
    /// The operating system would not give the file.
    #[error("{file}: cannot be read: {error}")]
    Unreadable {
        /// File.
        file: String,
        /// Reason.
        error: std::io::Error,
    },
    /// More bytes than the cap.
    #[error("{file}: expected at most {limit} bytes, found more")]
    TooLarge {
        /// File.
        file: String,
        /// Cap, bytes.
        limit: u64,
    },
    /// The file is not text.
    #[error("{file}: expected text in UTF-8, found something else at byte {offset}")]
    NotText {
        /// File.
        file: String,
        /// Bytes before it.
        offset: usize,
    },
    /// Not JSON, or a key that is unknown, missing or of the wrong kind.
    #[error("{file}:{line}:{column}: {message}")]
    Syntax {
        /// File.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What was expected and found.
        message: String,
    },
    /// Not a table of numbers.
    #[error(transparent)]
    Table(#[from] LogFileError),
    /// A field has a value that makes no sense.
    #[error("{file}: {field}: expected {expected}, found {found}")]
    Field {
        /// File.
        file: String,
        /// Field, such as `joints[2].a`.
        field: String,
        /// What is accepted.
        expected: String,
        /// What is there.
        found: String,
    },
    /// The coefficients form no trajectory.
    #[error("{file}: {source}")]
    Trajectory {
        /// File.
        file: String,
        /// The fault.
        source: TrajectoryError,
    },
}

impl TrajectoryFileError {
    /// What to do about it.
    pub fn hint(&self) -> Option<String> {
        use TrajectoryFileError as E;
        let hint = match self {
            E::Unreadable { error, .. } if error.kind() == std::io::ErrorKind::NotFound => "check the path",
            E::Unreadable { .. } => "check that the path is a file and may be read",
            E::TooLarge { .. } => "a trajectory file holds coefficients, not samples",
            E::NotText { .. } => "a trajectory file is JSON in UTF-8",
            E::Syntax { message, .. } if message.contains("unknown field") => {
                "unknown keys are errors so that a misspelt one cannot be ignored"
            }
            E::Syntax { .. } => "a trajectory file is JSON as `dynid design` writes it",
            E::Table(error) => return error.hint(),
            E::Field { expected, .. } if expected.starts_with("a column") => {
                "a table of a trajectory has the columns `t`, and `q_<joint>`, `dq_<joint>`, `ddq_<joint>` of every joint, as `dynid motion` writes it"
            }
            E::Field { field, .. } if field == "schema" => {
                "the file is no trajectory, or one of another version of the program"
            }
            E::Field { .. } => "correct the field",
            E::Trajectory { source: TrajectoryError::Order { .. }, .. } => {
                "name the parts of a row in their order, for example `a1..a5,b1..b5,q0`"
            }
            E::Trajectory { .. } => "correct the coefficients or samples",
        };
        Some(hint.to_owned())
    }
}

impl TrajectoryFileError {
    pub(super) fn of_text(file: String, fault: TextFault) -> Self {
        match fault {
            TextFault::Unreadable(error) => TrajectoryFileError::Unreadable { file, error },
            TextFault::TooLarge { limit } => TrajectoryFileError::TooLarge { file, limit },
            TextFault::NotText { offset, .. } => TrajectoryFileError::NotText { file, offset },
        }
    }
}
