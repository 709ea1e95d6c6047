//! Logs as tools write them: which format, which columns, where numbers, lists and texts are, and what is missing.
//!
//! A log is opened first: its first lines tell the delimiter, the decimal mark, the names of the columns and the tool that
//! wrote it ([`LogText::open`]). Then columns are assigned to signals ([`ColumnMapping::of_log`](crate::ColumnMapping::of_log)),
//! and only those that are used are read ([`LogText::read`]).

mod cell;
mod fault;
mod format;
mod header;
mod layout;
mod read;
mod ros;
mod row;

use serde::{Deserialize, Serialize};

pub use format::LogFormat;
pub use header::LogHeader;
pub use read::{LogText, Wanted};

use crate::csv::ReadOptions;

/// What stands between the whole part and the fraction of a number.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
pub enum DecimalMark {
    /// `0.5`
    #[serde(rename = ".")]
    Point,
    /// `0,5`
    #[serde(rename = ",")]
    Comma,
}

/// What becomes of rows in which a signal has no value: an empty cell, NaN, or a word such as `null`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Missing {
    /// The log is refused.
    Error,
    /// Rows without all signals are left out; the clock takes what is missing for a gap.
    Drop,
    /// Signals are interpolated linearly at the rows that have all positions, for logs that mix topics with stamps of their
    /// own. Where a signal is silent for more than five of its usual steps the rows are left out.
    Interpolate,
}

/// Settings of [`LogText::open`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogOptions {
    /// Rows, delimiter, columns to ignore and bounds.
    pub read: ReadOptions,
    /// Names of the columns of a file without a header. Default: `column1`, `column2`, ...
    pub names: Option<Vec<String>>,
    /// Decimal mark. Default: found from the numbers.
    pub decimal: Option<DecimalMark>,
}

/// A setting of the reading that was found, with its reason.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReadingNote {
    /// What was found out: `format`, `header`, `decimal`, `time`, ...
    pub setting: String,
    /// The value that was taken.
    pub value: String,
    /// Why.
    pub reason: String,
}

impl ReadingNote {
    /// A setting with its value and reason.
    pub fn new(setting: &str, value: impl Into<String>, reason: impl Into<String>) -> Self {
        ReadingNote { setting: setting.to_owned(), value: value.into(), reason: reason.into() }
    }
}
