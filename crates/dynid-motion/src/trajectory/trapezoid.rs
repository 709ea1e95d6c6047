//! Rest, constant speed, rest, with constant acceleration between.

use super::error::check;
use super::{Point, Profile, TrajectoryError};

/// Trapezoidal velocity: constant acceleration, constant speed, constant deceleration.
///
/// The acceleration jumps at both ends of both ramps, where no finite jerk could follow it: the jerk is given as 0
/// everywhere, the acceleration at time 0 and at the end as that of the rest. Prefer [`super::PaulBlend`] where drives or
/// structures would ring.
#[derive(Debug, Clone, PartialEq)]
pub struct Trapezoid {
    from: f64,
    speed: f64,
    ramp: f64,
    cruise: f64,
}

impl Trapezoid {
    /// Runs at `speed` (of either sign, per s) for `cruise` seconds with ramps of `acceleration` (positive, per s^2).
    ///
    /// Fails if the acceleration is not positive, the cruise is negative or a number is not finite.
    pub fn constant_velocity(
        from: f64,
        speed: f64,
        acceleration: f64,
        cruise: f64,
    ) -> Result<Self, TrajectoryError> {
        check("from", from, false)?;
        check("speed", speed, false)?;
        check("acceleration", acceleration, true)?;
        if !(cruise.is_finite() && cruise >= 0.0) {
            let expected = "a finite number that is not negative";
            return Err(TrajectoryError::Value { name: "cruise", expected, found: cruise });
        }
        Ok(Trapezoid { from, speed, ramp: speed.abs() / acceleration, cruise })
    }

    /// Goes from rest at `from` to rest at `to` in the shortest time with no more than `speed` and `acceleration` (both
    /// positive); a short way has no cruise.
    ///
    /// Fails if speed or acceleration is not positive or a number is not finite.
    pub fn point_to_point(
        from: f64,
        to: f64,
        speed: f64,
        acceleration: f64,
    ) -> Result<Self, TrajectoryError> {
        check("to", to, false)?;
        check("speed", speed, true)?;
        check("acceleration", acceleration, true)?;
        let distance = to - from;
        let speed = speed.min((distance.abs() * acceleration).sqrt());
        let cruise = if speed > 0.0 { (distance.abs() / speed - speed / acceleration).max(0.0) } else { 0.0 };
        Self::constant_velocity(from, speed.copysign(distance), acceleration, cruise)
    }

    /// Start and end of the cruise, s.
    pub fn cruise(&self) -> (f64, f64) {
        (self.ramp, self.ramp + self.cruise)
    }

    /// The ramp up at `time` in `[0, ramp]`, position counted from its start.
    fn ramp_at(&self, time: f64) -> Point {
        let acceleration = self.speed / self.ramp;
        Point {
            position: 0.5 * acceleration * time * time,
            velocity: acceleration * time,
            acceleration,
            jerk: 0.0,
        }
    }
}

impl Profile for Trapezoid {
    fn duration(&self) -> f64 {
        2.0 * self.ramp + self.cruise
    }

    fn at(&self, time: f64) -> Point {
        let end = self.from + self.speed * (self.ramp + self.cruise);
        let left = self.duration() - time;
        if time <= 0.0 {
            Point::rest(self.from)
        } else if left <= 0.0 {
            Point::rest(end)
        } else if time < self.ramp {
            let point = self.ramp_at(time);
            Point { position: self.from + point.position, ..point }
        } else if left < self.ramp {
            let mirrored = self.ramp_at(left);
            Point { position: end - mirrored.position, acceleration: -mirrored.acceleration, ..mirrored }
        } else {
            let position = self.from + self.speed * (time - 0.5 * self.ramp);
            Point { position, velocity: self.speed, ..Point::default() }
        }
    }
}
