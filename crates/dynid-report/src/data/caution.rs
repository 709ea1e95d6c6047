//! What to look at before a result is used.

use serde::Serialize;

use super::{Status, Value};

/// Something to look at before a result is used, with what mends it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Caution {
    /// `fail` or `warn`.
    pub status: Status,
    /// What it is about, e.g. `excitation`.
    pub name: String,
    /// The number it was judged by.
    pub value: Value,
    /// Unit of `value`.
    pub unit: String,
    /// The limit that the number was compared with, in words; may be empty.
    pub limit: String,
    /// What was found, in words.
    pub message: String,
    /// What mends it: a command or the line to write; back-ticks make code.
    pub remedy: String,
}

/// How many parameters there are, and of how many the logs tell the value.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counts {
    /// Base parameters.
    pub base: u64,
    /// Base parameters that the logs excite.
    pub base_excited: u64,
    /// Base parameters that the logs determine.
    pub base_seen: u64,
    /// Standard parameters.
    pub standard: u64,
    /// Standard parameters that the logs determine.
    pub standard_seen: u64,
    /// Standard parameters that the prior carries.
    pub standard_carried: u64,
    /// Standard parameters that no log can show.
    pub standard_not_identifiable: u64,
    /// Standard parameters that are given.
    pub standard_given: u64,
    /// Shape parameters of friction.
    pub shape: u64,
    /// Shape parameters that the logs determine.
    pub shape_seen: u64,
}
