//! Small sinusoids about a position, from rest to rest.

use std::f64::consts::TAU;

use super::error::check;
use super::{Point, Profile, Quintic, TrajectoryError};

/// A sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tone {
    /// Frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude, rad or m.
    pub amplitude: f64,
}

/// `q = middle + w(t) Σ A_k sin(2π f_k t)`: sinusoids that rise from rest and end there, for motion within the bristles of
/// friction (pre-sliding).
///
/// The weight `w` is a [`Quintic`] from 0 to 1 in the first `fade` seconds, 1, and the mirrored quintic in the last `fade`
/// seconds: position, velocity and acceleration vanish at both ends, the jerk of the product too at the start.
#[derive(Debug, Clone, PartialEq)]
pub struct FadedTones {
    middle: f64,
    tones: Vec<Tone>,
    duration: f64,
    fade: Quintic,
}

impl FadedTones {
    /// Sinusoids about `middle` (rad or m) for `duration` seconds.
    ///
    /// # Errors
    /// Without a tone, for a frequency or fade that is not positive, a duration below two fades, a number that is not finite.
    pub fn new(middle: f64, tones: Vec<Tone>, duration: f64, fade: f64) -> Result<Self, TrajectoryError> {
        check("middle", middle, false)?;
        check("fade", fade, true)?;
        if !(duration.is_finite() && duration >= 2.0 * fade) {
            let expected = "a finite number not below two fades";
            return Err(TrajectoryError::Value { name: "duration", expected, found: duration });
        }
        if tones.is_empty() {
            return Err(TrajectoryError::Value { name: "tones", expected: "at least 1", found: 0.0 });
        }
        for tone in &tones {
            check("frequency", tone.frequency_hz, true)?;
            check("amplitude", tone.amplitude, false)?;
        }
        Ok(FadedTones { middle, tones, duration, fade: Quintic::new(0.0, 1.0, fade)? })
    }

    /// The weight and its derivatives.
    fn weight(&self, time: f64) -> Point {
        let left = self.duration - time;
        if time < self.fade.duration() {
            self.fade.at(time)
        } else if left < self.fade.duration() {
            let mirrored = self.fade.at(left);
            Point { velocity: -mirrored.velocity, jerk: -mirrored.jerk, ..mirrored }
        } else {
            Point::rest(1.0)
        }
    }
}

impl Profile for FadedTones {
    fn duration(&self) -> f64 {
        self.duration
    }

    fn at(&self, time: f64) -> Point {
        if time <= 0.0 || time >= self.duration {
            return Point::rest(self.middle);
        }
        let mut sum = Point::default();
        for Tone { frequency_hz, amplitude } in &self.tones {
            let w = TAU * frequency_hz;
            let (sine, cosine) = (w * time).sin_cos();
            sum.position += amplitude * sine;
            sum.velocity += amplitude * w * cosine;
            sum.acceleration -= amplitude * w * w * sine;
            sum.jerk -= amplitude * w * w * w * cosine;
        }
        let w = self.weight(time);
        Point {
            position: self.middle + w.position * sum.position,
            velocity: w.velocity * sum.position + w.position * sum.velocity,
            acceleration: w.acceleration * sum.position
                + 2.0 * w.velocity * sum.velocity
                + w.position * sum.acceleration,
            jerk: w.jerk * sum.position
                + 3.0 * (w.acceleration * sum.velocity + w.velocity * sum.acceleration)
                + w.position * sum.jerk,
        }
    }
}
