//! Lines of a stream that are skipped.

use dynid_files::excerpt::excerpt_bytes;
use thiserror::Error;

/// Why a line is skipped.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum BadLine {
    /// Another number of fields than the header has.
    #[error("expected {expected} fields, found {found}")]
    FieldCount {
        /// Columns of the header.
        expected: usize,
        /// Fields of the line.
        found: usize,
    },
    /// A field that is no number.
    #[error("column `{column}`: expected a number, found `{found}`")]
    NotANumber {
        /// Column.
        column: String,
        /// The field.
        found: String,
    },
    /// NaN, an infinity or nothing.
    #[error("column `{column}`: expected a finite number, found `{found}`")]
    NotFinite {
        /// Column.
        column: String,
        /// The field.
        found: String,
    },
    /// A number that no signal reaches.
    #[error("column `{column}`: expected at most 1e12 in magnitude, found `{found}`")]
    TooBig {
        /// Column.
        column: String,
        /// The field.
        found: String,
    },
    /// No JSON object.
    #[error("expected a JSON object, found {found}")]
    NotJson {
        /// What it is instead.
        found: String,
    },
    /// A field that the first line had is missing.
    #[error("expected a field `{column}`, found none")]
    Missing {
        /// Column.
        column: String,
    },
}

/// Largest magnitude of a number outside time columns, as in logs.
const MAX_MAGNITUDE: f64 = 1e12;

/// A number that may enter a row of a column.
pub(super) fn checked(column: &str, x: f64, is_time: bool) -> Result<f64, BadLine> {
    let found = || excerpt_bytes(x.to_string().as_bytes());
    if !x.is_finite() {
        return Err(BadLine::NotFinite { column: column.to_owned(), found: found() });
    }
    if x.abs() > MAX_MAGNITUDE && !is_time {
        return Err(BadLine::TooBig { column: column.to_owned(), found: found() });
    }
    Ok(x)
}
