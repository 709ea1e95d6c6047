//! Fourier series through samples, by least squares.

use crate::signal::rms;

/// Offset, sine and cosine amplitudes: `q_n = c0 + sum_k [s_k sin(k step n) + c_k cos(k step n)]`, `n = 0, 1, ..`.
#[derive(Debug, Clone, PartialEq)]
pub struct Harmonics {
    /// Phase of the first harmonic per sample, rad.
    pub step: f64,
    /// Offset `c0`.
    pub offset: f64,
    /// Sine amplitudes `s_k` from the first harmonic on.
    pub sine: Vec<f64>,
    /// Cosine amplitudes `c_k` from the first harmonic on.
    pub cosine: Vec<f64>,
}

/// Samples over which a rotation is carried on before it is computed afresh.
const CARRIED: usize = 256;

/// Calls `take(n, sin, cos)` for the phases `rate n` of all samples.
fn rotate(rate: f64, samples: usize, mut take: impl FnMut(usize, f64, f64)) {
    let (turn_sin, turn_cos) = rate.sin_cos();
    for start in (0..samples).step_by(CARRIED) {
        let (mut sin, mut cos) = (rate * start as f64).sin_cos();
        for n in start..(start + CARRIED).min(samples) {
            take(n, sin, cos);
            (sin, cos) = (sin * turn_cos + cos * turn_sin, cos * turn_cos - sin * turn_sin);
        }
    }
}

impl Harmonics {
    fn zero(step: f64, count: usize) -> Self {
        Harmonics { step, offset: 0.0, sine: vec![0.0; count], cosine: vec![0.0; count] }
    }

    /// Least squares fit of `count` harmonics through the usable samples.
    ///
    /// Over whole periods the columns are nearly orthogonal, so that conjugate gradients on the normal equations end
    /// after a few steps; their condition number is near 1. Samples must be finite, and more than `2 count + 1` usable
    /// over a good part of a period: nothing else is checked, and fewer leave some amplitudes arbitrary.
    ///
    /// # Panics
    /// If `usable` is longer than `signal`.
    pub fn fit(signal: &[f64], usable: &[bool], step: f64, count: usize) -> Self {
        let samples = usable.iter().filter(|u| **u).count() as f64;
        // Without its middle, so that the offset costs the amplitudes no digits.
        let middle = masked(signal, usable).sum::<f64>() / samples.max(1.0);
        let mut residual: Vec<f64> =
            signal.iter().zip(usable).map(|(x, u)| if *u { x - middle } else { 0.0 }).collect();
        let mut x = Self::zero(step, count);
        let mut gradient = x.projected(&residual);
        let mut scaled = gradient.preconditioned(samples);
        let mut direction = scaled.clone();
        let mut size = gradient.dot(&scaled);
        let enough = 1e-30 * size;
        for _ in 0..MOST_STEPS {
            if size <= enough {
                break;
            }
            let mut image = direction.values(signal.len());
            for (value, used) in image.iter_mut().zip(usable) {
                if !used {
                    *value = 0.0;
                }
            }
            let length = size / image.iter().map(|v| v * v).sum::<f64>();
            x.add(length, &direction);
            for (r, v) in residual.iter_mut().zip(&image) {
                *r -= length * v;
            }
            gradient = x.projected(&residual);
            scaled = gradient.preconditioned(samples);
            let next = gradient.dot(&scaled);
            direction = {
                scaled.add(next / size, &direction);
                scaled
            };
            size = next;
        }
        x.offset += middle;
        x
    }

    /// Values at the samples `0..samples`.
    pub fn values(&self, samples: usize) -> Vec<f64> {
        let mut out = vec![self.offset; samples];
        for (k, (s, c)) in self.sine.iter().zip(&self.cosine).enumerate() {
            let rate = self.step * (k + 1) as f64;
            rotate(rate, samples, |n, sin, cos| out[n] += s * sin + c * cos);
        }
        out
    }

    /// The derivative with respect to time at a sample rate.
    pub fn derivative(&self, rate_hz: f64) -> Self {
        let omega = |k: usize| self.step * rate_hz * (k + 1) as f64;
        Harmonics {
            step: self.step,
            offset: 0.0,
            sine: self.cosine.iter().enumerate().map(|(k, c)| -omega(k) * c).collect(),
            cosine: self.sine.iter().enumerate().map(|(k, s)| omega(k) * s).collect(),
        }
    }

    /// Squared amplitude of each harmonic.
    pub fn powers(&self) -> Vec<f64> {
        self.sine.iter().zip(&self.cosine).map(|(s, c)| s * s + c * c).collect()
    }

    /// RMS of what the usable samples are off the series.
    pub fn residual_rms(&self, signal: &[f64], usable: &[bool]) -> f64 {
        let values = self.values(signal.len());
        let off: Vec<f64> =
            signal.iter().zip(values).zip(usable).filter(|(_, u)| **u).map(|((x, v), _)| x - v).collect();
        rms(&off)
    }

    fn projected(&self, residual: &[f64]) -> Self {
        let mut out = Self::zero(self.step, self.sine.len());
        out.offset = residual.iter().sum();
        for (k, (s, c)) in out.sine.iter_mut().zip(&mut out.cosine).enumerate() {
            let rate = self.step * (k + 1) as f64;
            rotate(rate, residual.len(), |n, sin, cos| {
                *s += residual[n] * sin;
                *c += residual[n] * cos;
            });
        }
        out
    }

    /// Divided by the diagonal of the normal equations: `n` for the offset, about `n / 2` for the rest.
    fn preconditioned(&self, samples: f64) -> Self {
        let half = |v: &[f64]| v.iter().map(|x| 2.0 * x / samples).collect();
        Harmonics {
            step: self.step,
            offset: self.offset / samples,
            sine: half(&self.sine),
            cosine: half(&self.cosine),
        }
    }

    fn dot(&self, other: &Self) -> f64 {
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        self.offset * other.offset + product(&self.sine, &other.sine) + product(&self.cosine, &other.cosine)
    }

    /// `self + factor other`.
    fn add(&mut self, factor: f64, other: &Self) {
        self.offset += factor * other.offset;
        for (x, y) in self.sine.iter_mut().zip(&other.sine) {
            *x += factor * y;
        }
        for (x, y) in self.cosine.iter_mut().zip(&other.cosine) {
            *x += factor * y;
        }
    }
}

/// Most steps of the conjugate gradients; gaps in the record are what may need more than a few.
const MOST_STEPS: usize = 60;

fn masked<'a>(signal: &'a [f64], usable: &'a [bool]) -> impl Iterator<Item = f64> + 'a {
    signal.iter().zip(usable).filter(|(_, u)| **u).map(|(x, _)| *x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_series_is_found_again_through_gaps_and_fractions_of_samples() {
        // 3 periods of 333.37 samples, one stretch missing.
        let step = std::f64::consts::TAU / 333.37;
        let truth = Harmonics {
            step,
            offset: 50.3,
            sine: vec![1.0, -0.3, 0.0, 0.02],
            cosine: vec![0.2, 0.7, -0.1, 1e-6],
        };
        let signal = truth.values(1000);
        for n in [0, 255, 256, 257, 999] {
            let direct: f64 = (0..4)
                .map(|k| {
                    let (sin, cos) = (step * ((k + 1) * n) as f64).sin_cos();
                    truth.sine[k] * sin + truth.cosine[k] * cos
                })
                .sum();
            assert!((signal[n] - 50.3 - direct).abs() < 1e-13);
        }
        let usable: Vec<bool> = (0..1000).map(|n| !(300..420).contains(&n)).collect();
        let found = Harmonics::fit(&signal, &usable, step, 7);
        assert!((found.offset - truth.offset).abs() < 1e-12);
        for k in 0..7 {
            let of = |v: &[f64]| v.get(k).copied().unwrap_or(0.0);
            assert!((of(&found.sine) - of(&truth.sine)).abs() < 1e-12, "{k}");
            assert!((of(&found.cosine) - of(&truth.cosine)).abs() < 1e-12, "{k}");
        }
        assert!(found.residual_rms(&signal, &usable) < 1e-12);
    }
}
