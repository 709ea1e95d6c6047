//! Constant-speed sweeps: every speed forth and back over the same positions.

use super::error::check;
use super::{PaulBlend, TrajectoryError};

/// What sweeps are made of.
#[derive(Debug, Clone, PartialEq)]
pub struct SweepSettings {
    /// Positions within which the coordinate moves, rad or m. Default: none, must be stated.
    pub range: (f64, f64),
    /// Speeds, positive, per s, each forth and back, in this order. Default: none, must be stated.
    pub speeds: Vec<f64>,
    /// Largest acceleration of the blends, per s². Default: none, must be stated.
    pub acceleration: f64,
    /// Largest jerk of the blends, per s³. Default: none (infinite).
    pub jerk: f64,
    /// Longest time at one speed, s: slow sweeps stay about the middle of the range. Default 20.
    pub longest_s: f64,
    /// Least time at one speed, s. Default 0.6: what [`crate::constant_speed::SegmentSettings`] cuts from both ends, and what
    /// it needs between.
    pub least_s: f64,
    /// Blends and cruises are whole samples of this rate, Hz. Default 500.
    pub rate_hz: f64,
}

impl Default for SweepSettings {
    fn default() -> Self {
        SweepSettings {
            range: (f64::NAN, f64::NAN),
            speeds: Vec::new(),
            acceleration: f64::NAN,
            jerk: f64::INFINITY,
            longest_s: 20.0,
            least_s: 0.6,
            rate_hz: 500.0,
        }
    }
}

/// Sweeps in the order in which they run, a pair per speed: from the lower to the upper end, and back.
///
/// The blend of speed `v` is as short as `1.5 v / blend ≤ acceleration` and `6 v / blend² ≤ jerk` allow; the way `v (blend + cruise)`
/// lies about the middle of the range and is as long as it, `longest_s` and whole samples let it be. Speeds are exact.
///
/// # Errors
/// [`TrajectoryError::ShortSweep`] for a speed that the range leaves less than `least_s` of, [`TrajectoryError::Value`] without a
/// speed and for numbers out of range.
pub fn sweeps(settings: &SweepSettings) -> Result<Vec<PaulBlend>, TrajectoryError> {
    let s = settings;
    let (low, high) = s.range;
    check("least position of a sweep", low, false)?;
    check("largest position of a sweep", high, false)?;
    if low >= high {
        let expected = "more than the least";
        return Err(TrajectoryError::Value { name: "largest position of a sweep", expected, found: high });
    }
    for (name, x) in [
        ("acceleration of a sweep", s.acceleration),
        ("longest time of a sweep", s.longest_s),
        ("sample rate", s.rate_hz),
    ] {
        check(name, x, true)?;
    }
    for (name, found) in [("jerk of a sweep", s.jerk), ("least time of a sweep", s.least_s)] {
        if found.is_nan() || found <= 0.0 {
            return Err(TrajectoryError::Value { name, expected: "a positive number", found });
        }
    }
    if s.speeds.is_empty() {
        return Err(TrajectoryError::Value { name: "speeds", expected: "at least 1", found: 0.0 });
    }
    let middle = 0.5 * (low + high);
    let mut out = Vec::with_capacity(2 * s.speeds.len());
    for speed in &s.speeds {
        check("speed", *speed, true)?;
        let blend = (1.5 * speed / s.acceleration).max((6.0 * speed / s.jerk).sqrt());
        let blend = (blend * s.rate_hz - 1e-9).ceil().max(1.0) / s.rate_hz;
        let room = (high - low) / speed - blend;
        let cruise = (room.min(s.longest_s) * s.rate_hz + 1e-9).floor() / s.rate_hz;
        if cruise < s.least_s {
            let (speed, cruise) = (*speed, room.max(0.0));
            return Err(TrajectoryError::ShortSweep { speed, range: s.range, cruise, least: s.least_s });
        }
        let half = 0.5 * speed * (blend + cruise);
        out.push(PaulBlend::constant_velocity(middle - half, *speed, blend, cruise)?);
        out.push(PaulBlend::constant_velocity(middle + half, -speed, blend, cruise)?);
    }
    Ok(out)
}
