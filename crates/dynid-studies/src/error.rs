//! What can go wrong.

use thiserror::Error;

/// Why a study could not be run.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StudyError {
    /// There is no study of this name.
    #[error("no study `{found}`; known: {}", known.join(", "))]
    Unknown {
        /// Name given.
        found: String,
        /// Names of the studies.
        known: Vec<String>,
    },
    /// Data that belong to a study do not say what its driver expects.
    #[error("study data {file}: {message}")]
    Data {
        /// Which.
        file: &'static str,
        /// What is wrong.
        message: String,
    },
    /// The pipeline refused.
    #[error(transparent)]
    Dynid(Box<dynid::Error>),
}

impl<E: Into<dynid::Error>> From<E> for StudyError {
    fn from(error: E) -> Self {
        StudyError::Dynid(Box::new(error.into()))
    }
}
