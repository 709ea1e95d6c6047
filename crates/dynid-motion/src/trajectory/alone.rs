//! One coordinate moves, the others rest.

use super::error::check;
use super::{Point, Profile, Trajectory, TrajectoryError, held};

/// One coordinate along a profile while all others rest: tests of single joints.
#[derive(Debug, Clone, PartialEq)]
pub struct Alone<P> {
    pose: Vec<f64>,
    coordinate: usize,
    profile: P,
}

impl<P: Profile> Alone<P> {
    /// `coordinate` (from 0) moves along `profile`, the others rest at `pose`, rad or m.
    ///
    /// # Errors
    /// If there is no such coordinate or a number of the pose is not finite.
    pub fn new(pose: Vec<f64>, coordinate: usize, profile: P) -> Result<Self, TrajectoryError> {
        if coordinate >= pose.len() {
            let found = coordinate as f64;
            let expected = "the number of a coordinate of the pose";
            return Err(TrajectoryError::Value { name: "coordinate", expected, found });
        }
        pose.iter().try_for_each(|q| check("pose", *q, false))?;
        Ok(Alone { pose, coordinate, profile })
    }

    /// The profile.
    pub fn profile(&self) -> &P {
        &self.profile
    }
}

impl<P: Profile> Trajectory for Alone<P> {
    fn coordinates(&self) -> usize {
        self.pose.len()
    }

    fn duration(&self) -> f64 {
        self.profile.duration()
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.pose.len(), "one point per coordinate");
        out.iter_mut().zip(&self.pose).for_each(|(point, q)| *point = Point::rest(*q));
        let (time, outside) = held(time, self.profile.duration());
        let moving = &mut out[self.coordinate];
        *moving = self.profile.at(time);
        if outside {
            moving.jerk = 0.0;
        }
    }
}
