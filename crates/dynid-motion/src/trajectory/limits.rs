//! Limits of the motion of one coordinate.

use super::Point;
use super::error::{Quantity, TrajectoryError};

/// Limits of one coordinate; infinite where there is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Least and greatest position, rad or m. Default: none.
    pub position: (f64, f64),
    /// Largest speed, per s. Default: none.
    pub velocity: f64,
    /// Largest acceleration, per s^2. Default: none.
    pub acceleration: f64,
    /// Largest jerk, per s^3. Default: none.
    pub jerk: f64,
}

impl Default for MotionLimits {
    fn default() -> Self {
        MotionLimits {
            position: (f64::NEG_INFINITY, f64::INFINITY),
            velocity: f64::INFINITY,
            acceleration: f64::INFINITY,
            jerk: f64::INFINITY,
        }
    }
}

impl MotionLimits {
    /// Lower and upper limit of a quantity.
    pub fn of(&self, quantity: Quantity) -> (f64, f64) {
        let both = |most: f64| (-most, most);
        match quantity {
            Quantity::Position => self.position,
            Quantity::Velocity => both(self.velocity),
            Quantity::Acceleration => both(self.acceleration),
            Quantity::Jerk => both(self.jerk),
        }
    }

    /// Middle of the position range.
    pub fn middle(&self) -> f64 {
        0.5 * (self.position.0 + self.position.1)
    }

    /// Half of the position range.
    pub fn half_range(&self) -> f64 {
        0.5 * (self.position.1 - self.position.0)
    }

    /// Largest deviation of a derivative from its middle (0: half the position range; 1 to 3: velocity, acceleration,
    /// jerk), if it is limited.
    pub fn of_derivative(&self, derivative: usize) -> Option<f64> {
        let limit = match derivative {
            0 => self.half_range(),
            1 => self.velocity,
            2 => self.acceleration,
            _ => self.jerk,
        };
        limit.is_finite().then_some(limit)
    }

    /// Fails if a limit is NaN, negative, zero for velocity, acceleration or jerk, or if the position range is empty.
    pub fn check(&self) -> Result<(), TrajectoryError> {
        let positive = [
            ("velocity limit", self.velocity),
            ("acceleration limit", self.acceleration),
            ("jerk limit", self.jerk),
        ];
        for (name, found) in positive {
            if found.is_nan() || found <= 0.0 {
                return Err(TrajectoryError::Value { name, expected: "a positive number", found });
            }
        }
        let (low, high) = self.position;
        if low.is_nan() || high.is_nan() || low > high {
            return Err(TrajectoryError::Value {
                name: "upper position limit",
                expected: "a number not below the lower limit",
                found: high,
            });
        }
        Ok(())
    }

    /// The first of position, velocity and acceleration that is beyond its limit by more than rounding, with its value.
    pub fn broken_by(&self, point: &Point) -> Option<(Quantity, f64)> {
        [
            (Quantity::Position, point.position),
            (Quantity::Velocity, point.velocity),
            (Quantity::Acceleration, point.acceleration),
        ]
        .into_iter()
        .find(|(quantity, value)| self.excess(*quantity, (*value, *value)) > ROUNDING)
    }

    /// How far a range of values reaches beyond its limits, in parts of the limit (of half the range for positions); not
    /// positive inside.
    pub fn excess(&self, quantity: Quantity, (least, most): (f64, f64)) -> f64 {
        let (low, high) = self.of(quantity);
        let over = (most - high).max(low - least);
        if over == f64::NEG_INFINITY {
            return over;
        }
        let half = 0.5 * (high - low);
        // A range open on one side, or of one point, has no width to measure by.
        over / if half.is_finite() && half > 0.0 { half } else { 1.0 }
    }
}

/// Excess that is taken for rounding.
pub(super) const ROUNDING: f64 = 1e-9;
