//! Ranges of the parameters of algorithms.

use super::error::SearchError;

/// Checks `lower < value < upper`; not met by a value that is no number.
pub(super) fn inside(
    algorithm: &'static str,
    parameter: &'static str,
    value: f64,
    lower: f64,
    upper: f64,
    expected: &'static str,
) -> Result<(), SearchError> {
    if lower < value && value < upper {
        return Ok(());
    }
    Err(SearchError::Parameter { algorithm, parameter, expected, found: value })
}

/// Checks `0 < value < ∞`.
pub(super) fn positive(
    algorithm: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<(), SearchError> {
    inside(algorithm, parameter, value, 0.0, f64::INFINITY, "positive and finite")
}

/// Checks `0 ≤ value < ∞`.
pub(super) fn not_negative(
    algorithm: &'static str,
    parameter: &'static str,
    value: f64,
) -> Result<(), SearchError> {
    if value == 0.0 {
        return Ok(());
    }
    inside(algorithm, parameter, value, 0.0, f64::INFINITY, "not negative and finite")
}
