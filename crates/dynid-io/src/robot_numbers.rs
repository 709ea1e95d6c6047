//! Numbers that a robot file may state.

/// Least limit of a velocity or an effort, rad/s, m/s, N m or N: what is smaller is a slip.
pub(crate) const LEAST_LIMIT: f64 = 1e-9;

/// Whether a robot file may state a number: finite, of moderate size, and no denormal, of which there is no quotient.
pub(crate) fn is_in_range(x: f64) -> bool {
    x == 0.0 || (x.is_normal() && x.abs() <= 1e30)
}
