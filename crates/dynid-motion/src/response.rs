//! Linear systems driven by signals that repeat: their steady state.

use std::f64::consts::TAU;
use std::sync::Arc;

use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// What a linear system makes of a signal that repeats, on samples of one period: every harmonic times the system's response.
///
/// Harmonics above half the sample rate are taken for those that they look like.
#[derive(Clone)]
pub struct PeriodicResponse {
    /// Responses of harmonics 0 to half the samples, over the number of samples.
    response: Vec<Complex<f64>>,
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
}

impl std::fmt::Debug for PeriodicResponse {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("PeriodicResponse").field("samples", &self.forward.len()).finish()
    }
}

impl PeriodicResponse {
    /// A system with the response `G(jω) = re + j im` at `ω` rad/s, for signals of so many samples in one period, s. The response is asked for at
    /// `ω = 0` and the harmonics.
    pub fn new(samples: usize, period_s: f64, response: impl Fn(f64) -> (f64, f64)) -> Self {
        let at = |k: usize| {
            let (re, im) = response(TAU * k as f64 / period_s);
            // The transform of real samples holds the constant and the highest harmonic of an even number as real numbers.
            let real = k == 0 || 2 * k == samples;
            Complex::new(re, if real { 0.0 } else { im }) / samples as f64
        };
        Self::planned(samples, (0..=samples / 2).map(at).collect())
    }

    /// Apart from what is generic: whoever plans a transform compiles all transforms.
    fn planned(samples: usize, response: Vec<Complex<f64>>) -> Self {
        let mut planner = RealFftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(samples), planner.plan_fft_inverse(samples));
        PeriodicResponse { response, forward, back }
    }

    /// The system that goes backwards in time: its matrix over the samples is the transpose.
    #[must_use]
    pub fn transposed(&self) -> Self {
        let response = self.response.iter().map(Complex::conj).collect();
        PeriodicResponse { response, forward: self.forward.clone(), back: self.back.clone() }
    }

    /// Puts one period of the steady state in place of the signal. What is not finite makes everything so.
    ///
    /// # Panics
    /// If the signal has another number of samples.
    pub fn apply(&self, signal: &mut [f64]) {
        let mut spectrum = self.forward.make_output_vec();
        let transformed = self.forward.process(signal, &mut spectrum);
        assert!(transformed.is_ok(), "samples of one period");
        spectrum.iter_mut().zip(&self.response).for_each(|(x, g)| *x *= g);
        let last = spectrum.len() - 1;
        spectrum[0].im = 0.0;
        if signal.len().is_multiple_of(2) {
            spectrum[last].im = 0.0;
        }
        let transformed = self.back.process(&mut spectrum, signal);
        assert!(transformed.is_ok(), "samples of one period");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_of_first_order_gives_its_steady_state() {
        // y' = (u - y)/T of u = 1 + sin wt: 1 + (sin wt - w T cos wt)/(1 + w² T²).
        let (samples, period, lag) = (60, 2.0, 0.3);
        let rate = TAU / period;
        let lagging = |w: f64| {
            let size = 1.0 + (w * lag).powi(2);
            (1.0 / size, -w * lag / size)
        };
        let time = |k: usize| period * k as f64 / samples as f64;
        let mut y: Vec<f64> = (0..samples).map(|k| 1.0 + (rate * time(k)).sin()).collect();
        PeriodicResponse::new(samples, period, lagging).apply(&mut y);
        for (k, y) in y.iter().enumerate() {
            let angle = rate * time(k);
            let (sin, cos) = angle.sin_cos();
            let expected = 1.0 + (sin - rate * lag * cos) / (1.0 + (rate * lag).powi(2));
            assert!((y - expected).abs() < 1e-14, "{k}: {y} {expected}");
        }
    }

    #[test]
    fn transposed_systems_have_transposed_matrices() {
        for samples in [7, 8] {
            let system = PeriodicResponse::new(samples, 1.0, |w| (1.0 / (1.0 + w), w.sin()));
            let column = |of: &PeriodicResponse, k: usize| {
                let mut x = vec![0.0; samples];
                x[k] = 1.0;
                of.apply(&mut x);
                x
            };
            let back = system.transposed();
            for i in 0..samples {
                for j in 0..samples {
                    assert!((column(&system, j)[i] - column(&back, i)[j]).abs() < 1e-15);
                }
            }
        }
    }
}
