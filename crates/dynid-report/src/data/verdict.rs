//! The result in plain words.

pub use dynid_record::Status;
use serde::Serialize;

use super::Value;

/// The result in plain words, for a reader who stops after the first screen.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Verdict {
    /// Overall outcome.
    pub status: Status,
    /// One line, e.g. `The model predicts unseen motion within 4 % of the effort`.
    pub headline: String,
    /// A few sentences: what was found, how far it can be trusted, what to do next.
    pub sentences: Vec<String>,
    /// What was checked.
    pub checks: Vec<Check>,
}

/// One check with its number.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Check {
    /// Outcome.
    pub status: Status,
    /// What was checked, e.g. `prediction of validation logs`.
    pub name: String,
    /// The number it was judged by.
    pub value: Value,
    /// Unit of `value`.
    pub unit: String,
    /// The limit it was compared with, in words, e.g. `below 10 %`; may be empty.
    pub limit: String,
    /// What the number means for the user of the model.
    pub meaning: String,
}

/// Something the reader should know before using the result.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Warning {
    /// What was noticed, with its place and number.
    pub message: String,
    /// What can be done about it; may be empty.
    pub hint: String,
}
