//! Rest, constant speed, rest, with smooth acceleration.

use super::error::check;
use super::{Point, Profile, TrajectoryError};

/// Paul's blend: speed `v h^2 (3 - 2 h)` with `h = t / blend` during the first blend, then a
/// cruise at speed `v`, then the first blend mirrored. Position, speed and acceleration are continuous; the jerk jumps.
///
/// Speed and acceleration peak at `v` and `1.5 v / blend`.
#[derive(Debug, Clone, PartialEq)]
pub struct PaulBlend {
    from: f64,
    speed: f64,
    blend: f64,
    cruise: f64,
}

impl PaulBlend {
    /// Runs at `speed` (of either sign, per s) for `cruise` seconds, with blends of `blend` seconds before and after.
    ///
    /// Fails if the blend is not positive, the cruise is negative or a number is not finite.
    pub fn constant_velocity(
        from: f64,
        speed: f64,
        blend: f64,
        cruise: f64,
    ) -> Result<Self, TrajectoryError> {
        check("from", from, false)?;
        check("speed", speed, false)?;
        check("blend", blend, true)?;
        if !(cruise.is_finite() && cruise >= 0.0) {
            let expected = "a finite number that is not negative";
            return Err(TrajectoryError::Value { name: "cruise", expected, found: cruise });
        }
        Ok(PaulBlend { from, speed, blend, cruise })
    }

    /// Goes from rest at `from` to rest at `to` at no more than `speed` (positive): a distance too short for it is gone
    /// without a cruise at `|to - from| / blend`.
    ///
    /// Fails if speed or blend is not positive or a number is not finite.
    pub fn point_to_point(from: f64, to: f64, speed: f64, blend: f64) -> Result<Self, TrajectoryError> {
        check("to", to, false)?;
        check("speed", speed, true)?;
        check("blend", blend, true)?;
        let distance = to - from;
        let cruise = distance.abs() / speed - blend;
        if cruise < 0.0 {
            return Self::constant_velocity(from, distance / blend, blend, 0.0);
        }
        Self::constant_velocity(from, speed.copysign(distance), blend, cruise)
    }

    /// Speed of the cruise, signed, per s.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Start and end of the cruise, s.
    pub fn cruise(&self) -> (f64, f64) {
        (self.blend, self.blend + self.cruise)
    }

    /// The first blend at `time` in `[0, blend]`, position counted from its start.
    fn blend_at(&self, time: f64) -> Point {
        let h = time / self.blend;
        let v = self.speed;
        Point {
            position: v * self.blend * h.powi(3) * (1.0 - 0.5 * h),
            velocity: v * h * h * (3.0 - 2.0 * h),
            acceleration: 6.0 * v * h * (1.0 - h) / self.blend,
            jerk: 6.0 * v * (1.0 - 2.0 * h) / self.blend.powi(2),
        }
    }
}

impl Profile for PaulBlend {
    fn duration(&self) -> f64 {
        2.0 * self.blend + self.cruise
    }

    fn at(&self, time: f64) -> Point {
        let end = self.from + self.speed * (self.blend + self.cruise);
        let left = self.duration() - time;
        if time < 0.0 {
            Point::rest(self.from)
        } else if left < 0.0 {
            Point::rest(end)
        } else if time < self.blend {
            let point = self.blend_at(time);
            Point { position: self.from + point.position, ..point }
        } else if left < self.blend {
            let mirrored = self.blend_at(left);
            Point { position: end - mirrored.position, acceleration: -mirrored.acceleration, ..mirrored }
        } else {
            let position = self.from + self.speed * (time - 0.5 * self.blend);
            Point { position, velocity: self.speed, ..Point::default() }
        }
    }
}
