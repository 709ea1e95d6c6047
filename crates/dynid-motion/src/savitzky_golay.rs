//! Smoothing and differentiation by polynomials over a window.

use crate::signal::{SignalError, check_positive, check_signal};

/// Position, velocity and acceleration on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// rad or m.
    pub position: Vec<f64>,
    /// Per s.
    pub velocity: Vec<f64>,
    /// Per s^2.
    pub acceleration: Vec<f64>,
}

/// Savitzky-Golay filter: every sample becomes the value, or a derivative, of the polynomial of degree `order` that fits the `window`
/// samples about it best in the sense of least squares.
///
/// The half window at either end takes values and derivatives of the polynomial of the outermost window. Polynomials up to the
/// degree pass unchanged, and their derivatives are exact, ends included. Weights come from Gram polynomials, so that no system of
/// equations is solved.
///
/// Sources: Savitzky & Golay 1964; ends and derivatives by Gram polynomials: Gorry 1990.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SavitzkyGolay {
    half: usize,
    order: usize,
}

impl SavitzkyGolay {
    /// A filter of `window` samples, odd, by polynomials of degree `order`, less than `window`.
    ///
    /// # Errors
    /// [`SignalError::Setting`] for a window that is even or zero, or an order that is not less than it.
    pub fn new(window: usize, order: usize) -> Result<Self, SignalError> {
        if window.is_multiple_of(2) {
            let expected = "an odd number of samples";
            return Err(SignalError::Setting { name: "window", expected, found: window as f64 });
        }
        if order >= window {
            let expected = "a degree less than the samples of the window";
            return Err(SignalError::Setting { name: "order", expected, found: order as f64 });
        }
        Ok(SavitzkyGolay { half: window / 2, order })
    }

    /// Samples of the window.
    pub fn window(&self) -> usize {
        2 * self.half + 1
    }

    /// Degree of the polynomials.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Weights of the samples of a window, first sample first, for the `derivative`-th derivative of its polynomial, per sample to
    /// that power, `at` samples behind its first one; the centre is at `window / 2`.
    ///
    /// # Panics
    /// If `at` lies outside the window.
    pub fn weights(&self, at: usize, derivative: usize) -> Vec<f64> {
        assert!(at < self.window(), "a place in the window");
        let m = self.half as f64;
        let place = |k: usize| k as f64 - m;
        let at = self.gram(place(at), derivative);
        // (2k+1) (2m)!/(2m-k)! (2m)!/(2m+k+1)!, the inverse squared norm of the k-th polynomial.
        let mut share = 1.0 / (2.0 * m + 1.0);
        let scales: Vec<f64> = (0..=self.order)
            .map(|k| {
                let degree = k as f64;
                if k > 0 {
                    share *= (2.0 * m - degree + 1.0) / (2.0 * m + degree + 1.0);
                }
                (2.0 * degree + 1.0) * share
            })
            .collect();
        let weight = |k: usize| -> f64 {
            let here = self.gram(place(k), 0);
            scales.iter().zip(&here).zip(&at).map(|((scale, x), y)| scale * x * y).sum()
        };
        (0..self.window()).map(weight).collect()
    }

    /// The `derivative`-th derivatives of the Gram polynomials up to the degree, at a place from the centre (Gorry 1990).
    fn gram(&self, place: f64, derivative: usize) -> Vec<f64> {
        let m = self.half as f64;
        // The derivative of one degree takes the next lower derivative of the degree below.
        let mut lower = vec![0.0; self.order + 1];
        let mut out = Vec::new();
        for s in 0..=derivative {
            out = vec![if s == 0 { 1.0 } else { 0.0 }; 1];
            for k in 1..=self.order {
                let degree = k as f64;
                let below = degree * (2.0 * m - degree + 1.0);
                let before = if k > 1 { out[k - 2] } else { 0.0 };
                let rise = place * out[k - 1] + s as f64 * lower[k - 1];
                let next = (4.0 * degree - 2.0) / below * rise
                    - (degree - 1.0) * (2.0 * m + degree) / below * before;
                out.push(next);
            }
            lower.clone_from(&out);
        }
        out
    }

    /// The `derivative`-th derivative of a signal, per s to that power; 0 smoothes it.
    ///
    /// # Errors
    /// [`SignalError`] with fewer samples than the window, if one is not finite, or the rate is not positive.
    pub fn filter(&self, signal: &[f64], derivative: usize, rate_hz: f64) -> Result<Vec<f64>, SignalError> {
        check_positive("rate_hz", rate_hz)?;
        let window = self.window();
        check_signal(signal, window)?;
        let per_time = (0..derivative).fold(1.0, |scale, _| scale * rate_hz);
        let weighted = |weights: &[f64], samples: &[f64]| {
            per_time * weights.iter().zip(samples).map(|(w, x)| w * x).sum::<f64>()
        };
        let (head, tail) = (&signal[..window], &signal[signal.len() - window..]);
        let end = |at: usize, samples: &[f64]| weighted(&self.weights(at, derivative), samples);
        let centre = self.weights(self.half, derivative);
        let mut out = Vec::with_capacity(signal.len());
        out.extend((0..self.half).map(|at| end(at, head)));
        out.extend(signal.windows(window).map(|samples| weighted(&centre, samples)));
        out.extend((self.half + 1..window).map(|at| end(at, tail)));
        Ok(out)
    }

    /// Position, velocity and acceleration: the polynomial's own derivatives.
    ///
    /// # Errors
    /// As [`SavitzkyGolay::filter`].
    pub fn states(&self, position: &[f64], rate_hz: f64) -> Result<States, SignalError> {
        let of = |derivative| self.filter(position, derivative, rate_hz);
        Ok(States { position: of(0)?, velocity: of(1)?, acceleration: of(2)? })
    }

    /// Frequency at which the amplitude falls to one half for the first time, in parts of the sample rate; `None` if it does not fall
    /// so far.
    pub fn half_amplitude(&self) -> Option<f64> {
        let weights = self.weights(self.half, 0);
        crate::smoothing::half_amplitude(&weights, 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_those_of_the_tables() {
        // Savitzky & Golay 1964, tables I, III and V: value, first and second derivative of quadratics and cubics.
        let cases: [(usize, usize, usize, &[f64], f64); 5] = [
            (5, 2, 0, &[-3.0, 12.0, 17.0, 12.0, -3.0], 35.0),
            (7, 3, 0, &[-2.0, 3.0, 6.0, 7.0, 6.0, 3.0, -2.0], 21.0),
            (5, 2, 1, &[-2.0, -1.0, 0.0, 1.0, 2.0], 10.0),
            (5, 3, 1, &[1.0, -8.0, 0.0, 8.0, -1.0], 12.0),
            (5, 2, 2, &[2.0, -1.0, -2.0, -1.0, 2.0], 7.0),
        ];
        for (window, order, derivative, table, over) in cases {
            let found = SavitzkyGolay::new(window, order).unwrap().weights(window / 2, derivative);
            for (w, t) in found.iter().zip(table) {
                assert!(
                    (w - t / over).abs() < 16.0 * f64::EPSILON,
                    "{window} {order} {derivative}: {found:?}"
                );
            }
        }
    }

    #[test]
    fn one_pass_of_five_point_smoothing_is_its_case() {
        let signal: Vec<f64> = (0..40).map(|k| (0.7 * f64::from(k)).sin() + 0.1 * f64::from(k)).collect();
        let found = SavitzkyGolay::new(5, 3).unwrap().filter(&signal, 0, 1.0).unwrap();
        let expected = crate::smoothing::five_point_cubic(&signal, 1).unwrap();
        for (x, y) in found.iter().zip(&expected) {
            assert!((x - y).abs() < 32.0 * f64::EPSILON * 5.0);
        }
    }

    #[test]
    fn polynomials_up_to_the_degree_are_exact_to_the_ends() {
        let rate = 50.0;
        let c = [0.3, -1.2, 0.7, 2.0, -0.4];
        let value = |t: f64| (c[0], c[1], c[2], c[3], c[4], t);
        let q = |t: f64| {
            let (a, b, c, d, e, t) = value(t);
            a + t * (b + t * (c + t * (d + t * e)))
        };
        let dq = |t: f64| c[1] + t * (2.0 * c[2] + t * (3.0 * c[3] + t * 4.0 * c[4]));
        let ddq = |t: f64| 2.0 * c[2] + t * (6.0 * c[3] + t * 12.0 * c[4]);
        let times: Vec<f64> = (0..60).map(|k| f64::from(k) / rate).collect();
        let signal: Vec<f64> = times.iter().map(|t| q(*t)).collect();
        let states = SavitzkyGolay::new(15, 4).unwrap().states(&signal, rate).unwrap();
        for (k, t) in times.iter().enumerate() {
            // Derivatives magnify rounding of values of size 3 by the sum of the weights' sizes times the rate's power: at the ends of the
            // window below 1 per sample and 0.4 per sample squared.
            let rounding = 64.0 * f64::EPSILON * 3.0;
            assert!((states.position[k] - q(*t)).abs() < rounding);
            assert!((states.velocity[k] - dq(*t)).abs() < rounding * rate);
            assert!((states.acceleration[k] - ddq(*t)).abs() < rounding * rate * rate);
        }
    }

    #[test]
    fn settings_and_signals_that_make_no_sense_are_errors() {
        assert!(matches!(SavitzkyGolay::new(8, 3), Err(SignalError::Setting { name: "window", .. })));
        assert!(matches!(SavitzkyGolay::new(0, 0), Err(SignalError::Setting { name: "window", .. })));
        assert!(matches!(SavitzkyGolay::new(5, 5), Err(SignalError::Setting { name: "order", .. })));
        let filter = SavitzkyGolay::new(5, 3).unwrap();
        assert_eq!(filter.filter(&[0.0; 4], 0, 1.0), Err(SignalError::TooShort { expected: 5, found: 4 }));
        assert!(matches!(
            filter.filter(&[0.0, f64::NAN, 0.0, 0.0, 0.0], 0, 1.0),
            Err(SignalError::NotFinite { sample: 1, .. })
        ));
        assert!(filter.filter(&[0.0; 5], 1, 0.0).is_err());
        assert_eq!(filter.filter(&[2.0; 5], 1, 10.0).unwrap().len(), 5);
    }

    #[test]
    fn the_amplitude_falls_to_one_half_where_the_response_says_so() {
        // The moving mean of three samples has the response (1 + 2 cos w)/3, one half at cos w = 1/4.
        let found = SavitzkyGolay::new(3, 0).unwrap().half_amplitude().unwrap();
        assert!((found - 0.25_f64.acos() / std::f64::consts::TAU).abs() < 1e-12);
        // A polynomial through every sample changes nothing.
        assert_eq!(SavitzkyGolay::new(3, 2).unwrap().half_amplitude(), None);
    }
}
