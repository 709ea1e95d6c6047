//! Why trajectories are refused.

use std::fmt;

/// A derivative of the position.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Position, rad or m.
    Position,
    /// Velocity, per s.
    Velocity,
    /// Acceleration, per s^2.
    Acceleration,
    /// Jerk, per s^3.
    Jerk,
}

impl Quantity {
    /// All four, position first.
    pub const ALL: [Quantity; 4] =
        [Quantity::Position, Quantity::Velocity, Quantity::Acceleration, Quantity::Jerk];
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Quantity::Position => "position",
            Quantity::Velocity => "velocity",
            Quantity::Acceleration => "acceleration",
            Quantity::Jerk => "jerk",
        })
    }
}

/// Why a trajectory was refused. Coordinates, segments and entries are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TrajectoryError {
    /// Sine and cosine amplitudes must come in pairs.
    #[error("expected as many cosine as sine amplitudes ({expected}), found {found}")]
    Harmonics {
        /// Sine amplitudes given.
        expected: usize,
        /// Cosine amplitudes given.
        found: usize,
    },
    /// A number is not finite or not in the range where it must be.
    #[error("{name}: expected {expected}, found {found}")]
    Value {
        /// Name of the number.
        name: &'static str,
        /// The range it must lie in.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
    /// A list has another length than it must have.
    #[error("{name}: expected {expected}, found {found}")]
    Count {
        /// What was counted.
        name: &'static str,
        /// Expected number.
        expected: usize,
        /// Number given.
        found: usize,
    },
    /// A row of coefficients has no offset beside its pairs of amplitudes.
    #[error(
        "row of coefficients: expected an odd number of entries (offset and pairs of amplitudes), found {found}"
    )]
    RowLength {
        /// Entries given.
        found: usize,
    },
    /// An order of coefficients that cannot be read.
    #[error(
        "order of coefficients: expected q0, a, b or ab in some order (such as `q0,a,b` or `a1,b1,..,a5,b5,q0`), found `{found}`"
    )]
    Order {
        /// What was given.
        found: String,
    },
    /// Series of one trajectory have different base frequencies.
    #[error(
        "base frequency of coordinate {coordinate}: expected {expected} rad/s as of the first, found {found}"
    )]
    BaseFrequency {
        /// Coordinate.
        coordinate: usize,
        /// Base frequency of the first series, rad/s.
        expected: f64,
        /// Base frequency of the other series, rad/s.
        found: f64,
    },
    /// A state through which the motion must go breaks a limit.
    #[error(
        "{quantity} of coordinate {coordinate} at an end of the motion: expected {low} to {high}, found {found}"
    )]
    EndBeyondLimit {
        /// Coordinate.
        coordinate: usize,
        /// What is beyond its limit.
        quantity: Quantity,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
        /// The value given.
        found: f64,
    },
    /// No duration keeps the limits.
    #[error(
        "no duration from {shortest} to {longest} s keeps the limits; at best {quantity} of coordinate {coordinate} is {found}, expected {low} to {high}"
    )]
    NoDuration {
        /// Shortest duration tried, s.
        shortest: f64,
        /// Longest duration tried, s.
        longest: f64,
        /// Coordinate that breaks its limit at the best duration.
        coordinate: usize,
        /// What is beyond its limit.
        quantity: Quantity,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
        /// The value there.
        found: f64,
    },
    /// A range of positions leaves too little time at a speed.
    #[error(
        "speed {speed}: expected at least {least} s at constant speed, found {cruise:.3} s within {} to {}",
        range.0,
        range.1
    )]
    ShortSweep {
        /// The speed.
        speed: f64,
        /// Least and largest position.
        range: (f64, f64),
        /// Time at the speed, s.
        cruise: f64,
        /// Least time, s.
        least: f64,
    },
    /// A segment does not start where the one before it ends.
    #[error(
        "{quantity} of coordinate {coordinate} jumps at {time} s where segment {segment} begins: expected {expected}, found {found}"
    )]
    Discontinuity {
        /// Segment that begins with the jump.
        segment: usize,
        /// Time of the jump, s.
        time: f64,
        /// Coordinate.
        coordinate: usize,
        /// What jumps.
        quantity: Quantity,
        /// Value at the end of the segment before.
        expected: f64,
        /// Value at the start of the segment.
        found: f64,
    },
}

/// Passes a finite number, positive if so asked.
pub(super) fn check(name: &'static str, found: f64, positive: bool) -> Result<(), TrajectoryError> {
    if found.is_finite() && (found > 0.0 || !positive) {
        return Ok(());
    }
    let expected = if positive { "a positive finite number" } else { "a finite number" };
    Err(TrajectoryError::Value { name, expected, found })
}

/// Passes a list of the expected length.
pub(super) fn check_count(name: &'static str, expected: usize, found: usize) -> Result<(), TrajectoryError> {
    if expected == found { Ok(()) } else { Err(TrajectoryError::Count { name, expected, found }) }
}
