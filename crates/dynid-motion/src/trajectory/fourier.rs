//! Finite Fourier series.

use super::{Point, TrajectoryError, check};

/// Finite Fourier series of one joint: `q = q0 + sum_l [A_l sin(l w t) + B_l cos(l w t)]`, `l = 1..`.
///
/// Two sets of coefficients are in use: [`Self::plain`] takes `A` and `B` (Swevers et al. 1997 with unit amplitudes),
/// [`Self::velocity_amplitudes`] takes amplitudes of the velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Fourier {
    base: f64,
    offset: f64,
    sine: Vec<f64>,
    cosine: Vec<f64>,
}

impl Fourier {
    /// `q = offset + sum_l [a_l sin(l w t) + b_l cos(l w t)]`; `base` is `w`, rad/s.
    ///
    /// Fails if `base` is not positive, the numbers of amplitudes differ or a number is not finite.
    pub fn plain(base: f64, offset: f64, a: Vec<f64>, b: Vec<f64>) -> Result<Self, TrajectoryError> {
        check("base frequency", base, true)?;
        check("offset", offset, false)?;
        if a.len() != b.len() {
            return Err(TrajectoryError::Harmonics { expected: a.len(), found: b.len() });
        }
        for amplitude in a.iter().chain(&b) {
            check("amplitude", *amplitude, false)?;
        }
        Ok(Self { base, offset, sine: a, cosine: b })
    }

    /// `q = offset + sum_l [a_l / (w l) sin(l w t) - b_l / (w l) cos(l w t)]`, so that
    /// `dq = sum_l [a_l cos(l w t) + b_l sin(l w t)]` (Tadese et al. 2022, Eq. 25); `base` is `w`, rad/s.
    ///
    /// Fails as [`Self::plain`].
    pub fn velocity_amplitudes(
        base: f64,
        offset: f64,
        a: &[f64],
        b: &[f64],
    ) -> Result<Self, TrajectoryError> {
        check("base frequency", base, true)?;
        let over_harmonic = |(k, x): (usize, &f64), sign: f64| sign * x / (base * (k + 1) as f64);
        Self::plain(
            base,
            offset,
            a.iter().enumerate().map(|x| over_harmonic(x, 1.0)).collect(),
            b.iter().enumerate().map(|x| over_harmonic(x, -1.0)).collect(),
        )
    }

    /// Base frequency `w`, rad/s.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Period, s.
    pub fn period(&self) -> f64 {
        std::f64::consts::TAU / self.base
    }

    /// Amplitudes `A_l`, `B_l` of the plain form.
    pub fn amplitudes(&self) -> (&[f64], &[f64]) {
        (&self.sine, &self.cosine)
    }

    /// Exact motion at `time`, s.
    pub fn at(&self, time: f64) -> Point {
        let mut point = Point { position: self.offset, velocity: 0.0, acceleration: 0.0 };
        for (k, (a, b)) in self.sine.iter().zip(&self.cosine).enumerate() {
            let rate = self.base * (k + 1) as f64;
            let (sin, cos) = (rate * time).sin_cos();
            let deviation = a * sin + b * cos;
            point.position += deviation;
            point.velocity += rate * (a * cos - b * sin);
            point.acceleration -= rate * rate * deviation;
        }
        point
    }
}
