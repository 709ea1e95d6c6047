//! Numbers that a robot file may state.

/// Least limit of a velocity or an effort, rad/s, m/s, N m or N: what is smaller is a slip.
pub(crate) const LEAST_LIMIT: f64 = 1e-9;

/// Whether a robot file may state a number: finite, of moderate size, and no denormal, of which there is no quotient.
pub(crate) fn is_in_range(x: f64) -> bool {
    x == 0.0 || (x.is_normal() && x.abs() <= 1e30)
}

/// A number that was worked out from those of a file, as a file may state it: a denormal one is zero. `None` beyond what files may state.
pub(crate) fn in_range(x: f64) -> Option<f64> {
    let x = if x.is_subnormal() { 0.0 } else { x };
    is_in_range(x).then_some(x)
}
