//! Smoothing and differentiation by a polynomial through the neighbours.

use std::f64::consts::{PI, SQRT_2};

use crate::signal::{SignalError, check_positive};

/// Degree of the polynomial.
const DEGREE: usize = 4;
/// Fewest samples on either side.
const LEAST: usize = 2;
/// Most samples on either side.
const MOST: usize = 100_000;

/// Weighted least-squares quartic through a sample and its neighbours: value, first and second derivative at its middle.
///
/// Sample weights `(1 - (k / (h + 1))²)²`, `k = -h .. h`. Polynomials up to degree 4 pass exactly, up to degree 5 in value and
/// second derivative; the phase is zero. With two neighbours on either side the value is the sample itself.
#[derive(Debug, Clone, PartialEq)]
pub struct LocalPolynomial {
    rate_hz: f64,
    half: usize,
    weights: [Vec<f64>; 3],
}

impl LocalPolynomial {
    /// `half`: samples on either side, at least 2.
    ///
    /// # Errors
    /// [`SignalError`] for a rate that is not positive or a width out of range.
    pub fn new(half: usize, rate_hz: f64) -> Result<Self, SignalError> {
        check_positive("rate_hz", rate_hz)?;
        if !(LEAST..=MOST).contains(&half) {
            return Err(SignalError::Setting {
                name: "half width",
                expected: "2 to 100000 samples",
                found: half as f64,
            });
        }
        Ok(LocalPolynomial { rate_hz, half, weights: weights(half, rate_hz) })
    }

    /// The widest one whose value still passes `1/√2` of a sine of `cutoff_hz`.
    ///
    /// # Errors
    /// [`SignalError`] for frequencies that are not positive, or a cut-off that would take more than 100000 samples.
    pub fn with_cutoff(cutoff_hz: f64, rate_hz: f64) -> Result<Self, SignalError> {
        check_positive("cutoff_hz", cutoff_hz)?;
        check_positive("rate_hz", rate_hz)?;
        let passes = |half: usize| gain(&weights(half, rate_hz)[0], cutoff_hz / rate_hz) >= 1.0 / SQRT_2;
        let mut most = LEAST;
        while passes(2 * most) {
            most *= 2;
            if most > MOST / 2 {
                return Err(SignalError::Setting {
                    name: "cutoff_hz",
                    expected: "a half width of at most 100000 samples",
                    found: cutoff_hz,
                });
            }
        }
        // The gain falls with the width up to the first zero, which lies beyond.
        let (mut passing, mut failing) = (most, 2 * most);
        while failing - passing > 1 {
            let middle = usize::midpoint(passing, failing);
            if passes(middle) { passing = middle } else { failing = middle }
        }
        Self::new(passing, rate_hz)
    }

    /// Samples on either side.
    pub fn half_width(&self) -> usize {
        self.half
    }

    /// Sample rate, Hz.
    pub fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    /// Weights of a derivative, of order 0, 1 or 2, `2 half_width + 1` of them.
    ///
    /// # Panics
    /// If the order is above 2.
    pub fn weights(&self, order: usize) -> &[f64] {
        &self.weights[order]
    }

    /// Standard deviation of a derivative of white noise of standard deviation 1.
    ///
    /// # Panics
    /// If the order is above 2.
    pub fn noise(&self, order: usize) -> f64 {
        self.weights[order].iter().map(|w| w * w).sum::<f64>().sqrt()
    }
}

/// Gain of symmetric weights at a frequency, cycles per sample.
fn gain(weights: &[f64], frequency: f64) -> f64 {
    let half = weights.len() / 2;
    let wave = |k: usize| (2.0 * PI * frequency * (k as f64 - half as f64)).cos();
    weights.iter().enumerate().map(|(k, w)| w * wave(k)).sum()
}

/// Weights of value, first and second derivative, by polynomials that are orthonormal over the samples (Stieltjes).
fn weights(half: usize, rate_hz: f64) -> [Vec<f64>; 3] {
    let count = 2 * half + 1;
    let x: Vec<f64> = (0..count).map(|k| (k as f64 - half as f64) / half as f64).collect();
    let taper = |x: f64| {
        let part = x * half as f64 / (half as f64 + 1.0);
        (1.0 - part * part).powi(2)
    };
    let w: Vec<f64> = x.iter().map(|x| taper(*x)).collect();
    let mut out = [vec![0.0; count], vec![0.0; count], vec![0.0; count]];
    // Of the polynomial before and the present one: values at the samples; value and two derivatives at 0.
    let mut before = (vec![0.0; count], [0.0; 3]);
    let mut norm = 1.0 / w.iter().sum::<f64>().sqrt();
    let mut present = (vec![norm; count], [norm, 0.0, 0.0]);
    let mut step = 0.0;
    for degree in 0..=DEGREE {
        for (order, out) in out.iter_mut().enumerate() {
            let scale = present.1[order] * (rate_hz / half as f64).powi(order as i32);
            for (o, (p, w)) in out.iter_mut().zip(present.0.iter().zip(&w)) {
                *o += scale * p * w;
            }
        }
        if degree == DEGREE {
            break;
        }
        // Symmetric weights: p_{n+1} = x p_n - b_n p_{n-1}, then scaled to length 1.
        let mut next: Vec<f64> =
            x.iter().zip(present.0.iter().zip(&before.0)).map(|(x, (p, b))| x * p - step * b).collect();
        let [p, dp, _] = present.1;
        let [b, db, ddb] = before.1;
        let mut at_zero = [-step * b, p - step * db, 2.0 * dp - step * ddb];
        norm = next.iter().zip(&w).map(|(p, w)| p * p * w).sum::<f64>().sqrt();
        next.iter_mut().for_each(|p| *p /= norm);
        at_zero.iter_mut().for_each(|p| *p /= norm);
        (before, present, step) = (present, (next, at_zero), norm);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn apply(weights: &[f64], f: impl Fn(f64) -> f64, rate: f64) -> f64 {
        let half = weights.len() / 2;
        weights.iter().enumerate().map(|(k, w)| w * f((k as f64 - half as f64) / rate)).sum()
    }

    #[test]
    fn quartics_pass_exactly() {
        for half in [2, 3, 7, 40, 300] {
            let rate = 250.0;
            let local = LocalPolynomial::new(half, rate).unwrap();
            // Scaled so that every power matters at the ends of the window.
            let h = half as f64 / rate;
            let f = |t: f64| {
                let x = t / h;
                0.7 - 1.3 * x + 2.1 * x * x - 0.4 * x.powi(3) + 0.9 * x.powi(4)
            };
            assert!((apply(local.weights(0), f, rate) - 0.7).abs() < 1e-12, "{half}");
            assert!((apply(local.weights(1), f, rate) * h + 1.3).abs() < 1e-11, "{half}");
            assert!((apply(local.weights(2), f, rate) * h * h - 4.2).abs() < 1e-10, "{half}");
        }
        let plain = LocalPolynomial::new(2, 10.0).unwrap();
        for (k, w) in plain.weights(0).iter().enumerate() {
            assert!((w - f64::from(u8::from(k == 2))).abs() < 1e-12);
        }
    }

    #[test]
    fn the_cutoff_is_where_the_gain_falls_to_its_root() {
        for (cutoff, rate) in [(20.0, 1000.0), (12.5, 100.0), (0.5, 400.0)] {
            let local = LocalPolynomial::with_cutoff(cutoff, rate).unwrap();
            let wider = LocalPolynomial::new(local.half_width() + 1, rate).unwrap();
            assert!(gain(local.weights(0), cutoff / rate) >= 1.0 / SQRT_2);
            assert!(gain(wider.weights(0), cutoff / rate) < 1.0 / SQRT_2);
            // Nearly flat to a third of the cut-off, in acceleration too.
            let f = cutoff / 3.0;
            let curvature = gain(local.weights(2), f / rate) / -(2.0 * PI * f).powi(2);
            assert!((curvature - 1.0).abs() < 0.03, "{curvature}");
        }
    }

    #[test]
    fn noise_and_bad_settings() {
        let local = LocalPolynomial::new(10, 1.0).unwrap();
        let direct: f64 = local.weights(2).iter().map(|w| w * w).sum();
        assert!((local.noise(2) - direct.sqrt()).abs() < 1e-15);
        assert!(LocalPolynomial::new(1, 1.0).is_err());
        assert!(LocalPolynomial::with_cutoff(0.0, 1.0).is_err());
        assert!(LocalPolynomial::with_cutoff(1e-9, 1.0).is_err());
        assert_eq!(LocalPolynomial::with_cutoff(40.0, 100.0).unwrap().half_width(), 2);
    }
}
