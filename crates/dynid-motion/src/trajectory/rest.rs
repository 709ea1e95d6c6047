//! A pose that is held.

use super::error::check;
use super::{Point, Trajectory, TrajectoryError};

/// All coordinates at rest for a while: a pause.
#[derive(Debug, Clone, PartialEq)]
pub struct Rest {
    pose: Vec<f64>,
    duration: f64,
}

impl Rest {
    /// Holds `pose` (rad or m) for `duration` seconds.
    ///
    /// # Errors
    /// If the duration is not positive, a number is not finite or there is no coordinate.
    pub fn new(pose: Vec<f64>, duration: f64) -> Result<Self, TrajectoryError> {
        check("duration", duration, true)?;
        if pose.is_empty() {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        }
        pose.iter().try_for_each(|q| check("pose", *q, false))?;
        Ok(Rest { pose, duration })
    }
}

impl Trajectory for Rest {
    fn coordinates(&self) -> usize {
        self.pose.len()
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, _: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.pose.len(), "one point per coordinate");
        out.iter_mut().zip(&self.pose).for_each(|(point, q)| *point = Point::rest(*q));
    }
}
