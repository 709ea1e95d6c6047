//! Limits of a coordinate that are linear in the trajectory's coefficients.

/// Limits of one coordinate; `None`: unlimited.
#[derive(Debug, Clone, PartialEq)]
pub struct CoordinateLimits {
    /// Least and largest position, rad or m. Needed: it sets the scale of the search.
    pub position: (f64, f64),
    /// Largest speed.
    pub velocity: Option<f64>,
    /// Largest acceleration.
    pub acceleration: Option<f64>,
    /// Largest jerk.
    pub jerk: Option<f64>,
}

impl CoordinateLimits {
    /// Middle of the range.
    pub fn middle(&self) -> f64 {
        0.5 * (self.position.0 + self.position.1)
    }

    /// Half of the range.
    pub fn half_range(&self) -> f64 {
        0.5 * (self.position.1 - self.position.0)
    }

    /// Limit of a derivative (0: half the range, 1 to 3: velocity, acceleration, jerk), if there is one.
    pub fn of_derivative(&self, derivative: usize) -> Option<f64> {
        match derivative {
            0 => Some(self.half_range()),
            1 => self.velocity,
            2 => self.acceleration,
            _ => self.jerk,
        }
    }
}
