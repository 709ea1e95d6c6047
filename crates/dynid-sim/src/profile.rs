//! Extra channels given as functions of time.

use crate::error::{SimError, demand};

/// A channel such as a temperature, linear between given points and constant outside of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    points: Vec<(f64, f64)>,
}

impl Profile {
    /// From `(time in s, value)`, times ascending.
    ///
    /// # Errors
    /// [`SimError::Setting`] without a point, with times that do not ascend, or with numbers that are not finite.
    pub fn new(points: Vec<(f64, f64)>) -> Result<Profile, SimError> {
        let finite = points.iter().all(|(t, x)| t.is_finite() && x.is_finite());
        let ascending = points.windows(2).all(|w| w[0].0 < w[1].0);
        let expected = "points of finite numbers with ascending times";
        demand(!points.is_empty() && finite && ascending, "profile", expected, format!("{points:?}"))?;
        Ok(Profile { points })
    }

    /// Value at a time, s.
    pub fn at(&self, time: f64) -> f64 {
        let next = self.points.partition_point(|(t, _)| *t <= time);
        match (next.checked_sub(1).map(|k| self.points[k]), self.points.get(next)) {
            (Some((t0, x0)), Some((t1, x1))) => x0 + (x1 - x0) * (time - t0) / (t1 - t0),
            (Some((_, x)), None) => x,
            (None, first) => first.map_or(0.0, |(_, x)| *x),
        }
    }

    /// Rate of change at a time, 1/s; at a point that after it.
    pub fn slope(&self, time: f64) -> f64 {
        let next = self.points.partition_point(|(t, _)| *t <= time);
        match (next.checked_sub(1).map(|k| self.points[k]), self.points.get(next)) {
            (Some((t0, x0)), Some((t1, x1))) => (x1 - x0) / (t1 - t0),
            _ => 0.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_are_linear_between_points_and_constant_outside() {
        let p = Profile::new(vec![(1.0, 20.0), (3.0, 30.0), (4.0, 29.0)]).unwrap();
        let found = [0.0, 1.0, 2.0, 3.0, 3.5, 9.0].map(|t| p.at(t));
        assert_eq!(found, [20.0, 20.0, 25.0, 30.0, 29.5, 29.0]);
        assert_eq!([0.0, 1.0, 2.0, 3.0, 9.0].map(|t| p.slope(t)), [0.0, 5.0, 5.0, -1.0, 0.0]);
        assert!(Profile::new(vec![]).is_err() && Profile::new(vec![(1.0, 0.0), (1.0, 2.0)]).is_err());
    }
}
