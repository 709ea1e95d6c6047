//! Motions of one coordinate, and several of them side by side.

use super::{Point, Trajectory, TrajectoryError, held};

/// Motion of one coordinate from time 0 to [`Self::duration`].
pub trait Profile: Send + Sync {
    /// Duration, s.
    fn duration(&self) -> f64;

    /// Exact motion at `time`, s; before 0 and after the duration at rest at the ends.
    fn at(&self, time: f64) -> Point;
}

/// One profile per coordinate, all started at time 0; those that end early rest until the last has ended.
#[derive(Debug, Clone, PartialEq)]
pub struct PerCoordinate<P> {
    profiles: Vec<P>,
    duration: f64,
}

impl<P: Profile> PerCoordinate<P> {
    /// Fails without a profile.
    pub fn new(profiles: Vec<P>) -> Result<Self, TrajectoryError> {
        if profiles.is_empty() {
            return Err(TrajectoryError::Value { name: "coordinates", expected: "at least 1", found: 0.0 });
        }
        let duration = profiles.iter().map(Profile::duration).fold(0.0, f64::max);
        Ok(PerCoordinate { profiles, duration })
    }

    /// The profiles.
    pub fn profiles(&self) -> &[P] {
        &self.profiles
    }
}

impl<P: Profile> Trajectory for PerCoordinate<P> {
    fn coordinates(&self) -> usize {
        self.profiles.len()
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64, out: &mut [Point]) {
        assert_eq!(out.len(), self.profiles.len(), "one point per coordinate");
        let (time, outside) = held(time, self.duration);
        for (point, profile) in out.iter_mut().zip(&self.profiles) {
            *point = profile.at(time);
            if outside {
                point.jerk = 0.0;
            }
        }
    }
}
