//! Why a clock is refused.

/// Why a log cannot be put on a uniform grid. Rows are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClockError {
    /// The clock runs backwards too often.
    #[error(
        "{log}: the time of {found} of {rows} rows lies before an earlier row, first at row {row}; expected at most {expected}"
    )]
    Backwards {
        /// Name of the log.
        log: String,
        /// First row that lies before an earlier one.
        row: usize,
        /// Rows that step back.
        found: usize,
        /// Rows that may step back.
        expected: usize,
        /// Rows of the log.
        rows: usize,
    },
    /// Too few rows have a time of their own, or the grid is too short.
    #[error("{log}: expected at least {expected} samples at increasing times, found {found}")]
    TooFewSamples {
        /// Name of the log.
        log: String,
        /// Samples needed.
        expected: usize,
        /// Samples left.
        found: usize,
    },
    /// The grid would be much longer than the record.
    #[error(
        "{log}: a grid of {rate_hz} Hz needs {found:.0} samples for {rows} rows, expected at most {expected:.0}; \
         the longest step, {duration} s, follows row {row}"
    )]
    GridTooLong {
        /// Name of the log.
        log: String,
        /// Sample rate, Hz.
        rate_hz: f64,
        /// Row before the longest step.
        row: usize,
        /// Length of the longest step, s.
        duration: f64,
        /// Grid samples needed.
        found: f64,
        /// Grid samples allowed.
        expected: f64,
        /// Rows of the log.
        rows: usize,
    },
    /// A setting is outside its range.
    #[error("{name}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The range it must lie in.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
}
