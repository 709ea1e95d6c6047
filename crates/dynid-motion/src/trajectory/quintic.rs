//! Quintic blend between two positions at rest.

use super::{Point, Profile, TrajectoryError, check};

/// `q = from + (to - from) (10 s^3 - 15 s^4 + 6 s^5)`, `s = t / duration`: velocity and acceleration vanish at both
/// ends, and the joint rests before and after.
#[derive(Debug, Clone, PartialEq)]
pub struct Quintic {
    from: f64,
    to: f64,
    duration: f64,
}

impl Quintic {
    /// Blend from `from` to `to` (rad or m) in `duration` seconds from time 0 on.
    ///
    /// Fails if the duration is not positive or a number is not finite.
    pub fn new(from: f64, to: f64, duration: f64) -> Result<Self, TrajectoryError> {
        check("from", from, false)?;
        check("to", to, false)?;
        check("duration", duration, true)?;
        Ok(Self { from, to, duration })
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Largest speed, `15/8 |to - from| / duration`, per s.
    pub fn peak_velocity(&self) -> f64 {
        1.875 * (self.to - self.from).abs() / self.duration
    }

    /// Largest acceleration, `10/sqrt(3) |to - from| / duration^2`, per s^2.
    pub fn peak_acceleration(&self) -> f64 {
        10.0 / 3f64.sqrt() * (self.to - self.from).abs() / self.duration.powi(2)
    }

    /// Exact motion at `time`, s.
    pub fn at(&self, time: f64) -> Point {
        let s = (time / self.duration).clamp(0.0, 1.0);
        let distance = self.to - self.from;
        let rest = 1.0 - s;
        // At s = 1 the rounded polynomial may miss the end by an ulp; a joint at rest must be exactly there.
        let position =
            if s == 1.0 { self.to } else { self.from + distance * s.powi(3) * (10.0 + s * (6.0 * s - 15.0)) };
        Point {
            position,
            velocity: 30.0 * distance / self.duration * (s * rest).powi(2),
            acceleration: 60.0 * distance / self.duration.powi(2) * s * rest * (1.0 - 2.0 * s),
            jerk: if (0.0..=self.duration).contains(&time) {
                60.0 * distance / self.duration.powi(3) * (1.0 - 6.0 * s * rest)
            } else {
                0.0
            },
        }
    }
}

impl Profile for Quintic {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64) -> Point {
        self.at(time)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blend_rests_at_both_ends_and_peaks_as_said() {
        let blend = Quintic::new(0.3, -1.2, 2.5).unwrap();
        for (t, position) in [(-1.0, 0.3), (0.0, 0.3), (2.5, -1.2), (9.0, -1.2)] {
            let point = blend.at(t);
            assert_eq!((point.position, point.velocity, point.acceleration), (position, 0.0, 0.0));
        }
        let points: Vec<Point> = (0..=25_000).map(|k| blend.at(f64::from(k) * 1e-4)).collect();
        let speed = points.iter().map(|p| p.velocity.abs()).fold(0.0, f64::max);
        let acceleration = points.iter().map(|p| p.acceleration.abs()).fold(0.0, f64::max);
        assert!((speed / blend.peak_velocity() - 1.0).abs() < 1e-12);
        assert!((acceleration / blend.peak_acceleration() - 1.0).abs() < 1e-7);
    }

    #[test]
    fn derivatives_agree_with_differences() {
        let blend = Quintic::new(0.3, -1.2, 2.5).unwrap();
        let h = 1e-5;
        for t in [0.2, 1.0, 1.9] {
            let (before, here, after) = (blend.at(t - h), blend.at(t), blend.at(t + h));
            assert!(((after.position - before.position) / (2.0 * h) - here.velocity).abs() < 1e-8);
            assert!(((after.velocity - before.velocity) / (2.0 * h) - here.acceleration).abs() < 1e-8);
            assert!(((after.acceleration - before.acceleration) / (2.0 * h) - here.jerk).abs() < 1e-8);
        }
        assert!(Quintic::new(0.0, 1.0, 0.0).is_err());
        assert!(Quintic::new(f64::NAN, 1.0, 1.0).is_err());
    }
}
