//! Values and derivatives of a finite Fourier series as matrices.

/// Rows of `q = B0 x`, `q̇ = B1 x`, `q̈ = B2 x`, `q⃛ = B3 x` at given times, for coefficients
/// `x = [q0, a_1..a_L, b_1..b_L]` of `q = q0 + Σ a_k sin kωt + b_k cos kωt`.
///
/// Source: Swevers et al. 1997.
#[derive(Debug, Clone, PartialEq)]
pub struct FourierBasis {
    harmonics: usize,
    base: f64,
    times: Vec<f64>,
    /// Per derivative: one row of `2 L + 1` numbers per time.
    rows: [Vec<f64>; 4],
}

impl FourierBasis {
    /// Rows at `times` (s) for `harmonics` harmonics of the fundamental `base` (rad/s).
    pub fn new(base: f64, harmonics: usize, times: Vec<f64>) -> Self {
        let width = 2 * harmonics + 1;
        let mut rows = [const { Vec::new() }; 4];
        for row in &mut rows {
            row.resize(width * times.len(), 0.0);
        }
        for (t, time) in times.iter().enumerate() {
            rows[0][t * width] = 1.0;
            for k in 1..=harmonics {
                let rate = base * k as f64;
                let (sin, cos) = (rate * time).sin_cos();
                let mut factor = 1.0;
                // d/dt turns (sin, cos) into rate·(cos, -sin).
                let mut pair = (sin, cos);
                for derivative in &mut rows {
                    derivative[t * width + k] = factor * pair.0;
                    derivative[t * width + harmonics + k] = factor * pair.1;
                    factor *= rate;
                    pair = (pair.1, -pair.0);
                }
            }
        }
        FourierBasis { harmonics, base, times, rows }
    }

    /// `samples` equidistant times over one period, the end excluded.
    pub fn on_period(base: f64, harmonics: usize, samples: usize) -> Self {
        let period = std::f64::consts::TAU / base;
        let times = (0..samples).map(|k| period * k as f64 / samples as f64).collect();
        Self::new(base, harmonics, times)
    }

    /// Harmonics `L`.
    pub fn harmonics(&self) -> usize {
        self.harmonics
    }

    /// Fundamental `ω`, rad/s.
    pub fn base(&self) -> f64 {
        self.base
    }

    /// Times of the rows, s.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    /// Row of a derivative (0 to 3) at a time: `2 L + 1` factors of the coefficients.
    pub fn row(&self, derivative: usize, time: usize) -> &[f64] {
        let width = 2 * self.harmonics + 1;
        &self.rows[derivative][time * width..][..width]
    }

    /// Values of a derivative at all times.
    pub fn evaluate(&self, derivative: usize, coefficients: &[f64], out: &mut [f64]) {
        let width = 2 * self.harmonics + 1;
        for (to, row) in out.iter_mut().zip(self.rows[derivative].chunks_exact(width)) {
            *to = row.iter().zip(coefficients).map(|(b, x)| b * x).sum();
        }
    }

    /// Adds `Bᵀ weights` of a derivative to `out`.
    pub fn accumulate(&self, derivative: usize, weights: &[f64], out: &mut [f64]) {
        let width = 2 * self.harmonics + 1;
        for (w, row) in weights.iter().zip(self.rows[derivative].chunks_exact(width)) {
            for (to, b) in out.iter_mut().zip(row) {
                *to += w * b;
            }
        }
    }

    /// Largest ratio of the extreme of a trigonometric polynomial of this degree between samples to its extreme on
    /// `samples` equidistant samples of a period: `1 / cos(π L / samples)` (Ehlich & Zeller 1964). `None` if there are
    /// not more than `2 L` samples.
    pub fn grid_factor(harmonics: usize, samples: usize) -> Option<f64> {
        (samples > 2 * harmonics)
            .then(|| 1.0 / (std::f64::consts::PI * harmonics as f64 / samples as f64).cos())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::Fourier;

    #[test]
    fn rows_give_the_series_and_its_derivatives() {
        let (a, b) = (vec![0.3, -0.2, 0.7], vec![-0.5, 0.1, 0.4]);
        let series = Fourier::plain(0.8, 0.25, a.clone(), b.clone()).unwrap();
        let basis = FourierBasis::on_period(0.8, 3, 17);
        let x = [&[0.25][..], &a, &b].concat();
        let mut values = [const { Vec::new() }; 4];
        for (d, v) in values.iter_mut().enumerate() {
            v.resize(17, 0.0);
            basis.evaluate(d, &x, v);
        }
        for (k, t) in basis.times().iter().enumerate() {
            let point = series.at(*t);
            assert!((values[0][k] - point.position).abs() < 1e-14);
            assert!((values[1][k] - point.velocity).abs() < 1e-14);
            assert!((values[2][k] - point.acceleration).abs() < 1e-14);
            let third: f64 = (1..=3)
                .map(|l| {
                    let rate = 0.8 * f64::from(l);
                    let (s, c) = (rate * t).sin_cos();
                    rate.powi(3) * (b[l as usize - 1] * s - a[l as usize - 1] * c)
                })
                .sum();
            assert!((values[3][k] - third).abs() < 1e-13);
        }
    }
}
