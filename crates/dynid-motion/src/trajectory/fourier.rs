//! Finite Fourier series of one coordinate.

use std::f64::consts::TAU;

use super::error::check;
use super::{Point, RowOrder, TrajectoryError};

/// Which coefficients describe a series.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Form {
    /// `q = q0 + sum_l [a_l sin(l w t) + b_l cos(l w t)]`.
    #[default]
    Plain,
    /// `q = q0 + sum_l [a_l / (l w) sin(l w t) - b_l / (l w) cos(l w t)]`, so that
    /// `dq = sum_l [a_l cos(l w t) + b_l sin(l w t)]` (Tadese et al. 2022, Eq. 25).
    VelocityAmplitudes,
}

/// Finite Fourier series of one coordinate: `q = q0 + sum_l [A_l sin(l w t) + B_l cos(l w t)]`, `l = 1..`, at all times.
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

/// An extreme value and the time in the first period at which it is attained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extreme {
    /// Time, s.
    pub time: f64,
    /// Value.
    pub value: f64,
}

/// Least and greatest value over a period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extremes {
    /// Least value.
    pub low: Extreme,
    /// Greatest value.
    pub high: Extreme,
}

impl Extremes {
    /// Greatest absolute value.
    pub fn magnitude(&self) -> f64 {
        self.low.value.abs().max(self.high.value.abs())
    }
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

    /// A published row of `2 L + 1` coefficients in the given order and form; `base` is `w`, rad/s.
    ///
    /// Fails as [`Self::plain`], if the row has an even number of entries, or if the order names another number of
    /// harmonics than the row holds.
    pub fn from_row(base: f64, form: Form, order: &RowOrder, row: &[f64]) -> Result<Self, TrajectoryError> {
        let (offset, a, b) = order.split(row)?;
        match form {
            Form::Plain => Self::plain(base, offset, a, b),
            Form::VelocityAmplitudes => Self::velocity_amplitudes(base, offset, &a, &b),
        }
    }

    /// The coefficients as a row in the given order and form.
    ///
    /// Fails if the order names another number of harmonics than the series has.
    pub fn to_row(&self, form: Form, order: &RowOrder) -> Result<Vec<f64>, TrajectoryError> {
        let (a, b) = self.coefficients(form);
        order.join(self.offset, &a, &b)
    }

    /// Coefficients `a_l`, `b_l` of a form.
    pub fn coefficients(&self, form: Form) -> (Vec<f64>, Vec<f64>) {
        let scaled = |amplitudes: &[f64], sign: f64| {
            amplitudes.iter().enumerate().map(|(k, x)| sign * x * self.base * (k + 1) as f64).collect()
        };
        match form {
            Form::Plain => (self.sine.clone(), self.cosine.clone()),
            Form::VelocityAmplitudes => (scaled(&self.sine, 1.0), scaled(&self.cosine, -1.0)),
        }
    }

    /// Base frequency `w`, rad/s.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Offset `q0`, rad or m.
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// Number of harmonics `L`.
    pub fn harmonics(&self) -> usize {
        self.sine.len()
    }

    /// Period, s.
    pub fn period(&self) -> f64 {
        TAU / self.base
    }

    /// Amplitudes `A_l`, `B_l` of the plain form.
    pub fn amplitudes(&self) -> (&[f64], &[f64]) {
        (&self.sine, &self.cosine)
    }

    /// Returns the motion with its amplitudes (not its offset) multiplied by `factor`.
    pub fn scaled(&self, factor: f64) -> Result<Self, TrajectoryError> {
        let times = |v: &[f64]| v.iter().map(|x| factor * x).collect();
        Self::plain(self.base, self.offset, times(&self.sine), times(&self.cosine))
    }

    /// Exact motion at `time`, s.
    pub fn at(&self, time: f64) -> Point {
        let mut point = Point::rest(self.offset);
        for (k, (a, b)) in self.sine.iter().zip(&self.cosine).enumerate() {
            let rate = self.base * (k + 1) as f64;
            let (sin, cos) = (rate * time).sin_cos();
            let (deviation, slope) = (a * sin + b * cos, rate * (a * cos - b * sin));
            point.position += deviation;
            point.velocity += slope;
            point.acceleration -= rate * rate * deviation;
            point.jerk -= rate * rate * slope;
        }
        point
    }

    /// The time derivative, a series without offset.
    pub fn derivative(&self) -> Fourier {
        let rate = |k: usize| self.base * (k + 1) as f64;
        Fourier {
            base: self.base,
            offset: 0.0,
            sine: self.cosine.iter().enumerate().map(|(k, b)| -rate(k) * b).collect(),
            cosine: self.sine.iter().enumerate().map(|(k, a)| rate(k) * a).collect(),
        }
    }

    /// Least and greatest position over a period. Those of the velocity are `derivative().extremes()`, and so on.
    ///
    /// All zeros of the velocity that a grid of `64 L` intervals separates are found by safeguarded Newton steps, so a
    /// peak between the points of any time grid is seen. Two zeros within one interval are missed; between them the
    /// position changes by less than `(2 pi / 64)^3 / 12 < 1e-4` of its largest distance from the offset (Bernstein).
    pub fn extremes(&self) -> Extremes {
        let start = Extreme { time: 0.0, value: self.at(0.0).position };
        let mut out = Extremes { low: start, high: start };
        let intervals = 64 * self.harmonics();
        let mut take = |time: f64| {
            let value = self.at(time).position;
            if value < out.low.value {
                out.low = Extreme { time, value };
            }
            if value > out.high.value {
                out.high = Extreme { time, value };
            }
        };
        let mut before = self.at(0.0).velocity;
        for k in 0..intervals {
            let [left, right] = [k, k + 1].map(|k| self.period() * k as f64 / intervals as f64);
            let after = self.at(right).velocity;
            take(left);
            if before * after < 0.0 {
                take(self.stationary_point(left, right, before));
            }
            before = after;
        }
        out
    }

    /// Time between `left` and `right` at which the velocity vanishes; it has opposite signs there, `at_left` on the left.
    fn stationary_point(&self, mut left: f64, mut right: f64, at_left: f64) -> f64 {
        let mut time = 0.5 * (left + right);
        for _ in 0..60 {
            let point = self.at(time);
            if point.velocity * at_left > 0.0 {
                left = time;
            } else {
                right = time;
            }
            let newton = time - point.velocity / point.acceleration;
            let next = if newton > left && newton < right { newton } else { 0.5 * (left + right) };
            if (next - time).abs() <= 1e-15 * self.period() {
                break;
            }
            time = next;
        }
        time
    }
}
