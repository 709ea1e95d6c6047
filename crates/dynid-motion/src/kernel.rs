//! The compact Gaussian kernel through which regressor columns and effort pass.

use std::ops::Range;

use crate::signal::{SignalError, check_positive};

/// Standard deviation in time is this over the nominal cut-off.
const SD_OF_CUTOFF: f64 = 0.265;
/// The kernel ends this many standard deviations from its centre.
const CUT_SD: f64 = 3.5;
/// Longest half width, samples; beyond it a kernel would not fit into memory sensibly.
const LONGEST: f64 = 1e7;

/// Gaussian of standard deviation `s_t = 0.265 / cutoff`, cut at `3.5 s_t`, weights of sum 1.
///
/// Positive and compact, so that it neither rings nor reaches past its half width: what lies under it is exact.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    cutoff_hz: f64,
    rate_hz: f64,
    weights: Vec<f64>,
}

impl Kernel {
    /// Kernel of a nominal cut-off for a sample rate, both in Hz. Where the half width is below one sample the kernel
    /// is the identity. Fails if a frequency is not positive or the half width exceeds 1e7 samples.
    pub fn new(cutoff_hz: f64, rate_hz: f64) -> Result<Self, SignalError> {
        check_positive("cutoff_hz", cutoff_hz)?;
        check_positive("rate_hz", rate_hz)?;
        let sd = SD_OF_CUTOFF / cutoff_hz * rate_hz;
        let reach = CUT_SD * sd;
        if reach.is_nan() || reach > LONGEST {
            return Err(SignalError::Setting {
                name: "cutoff_hz",
                expected: "a half width of at most 1e7 samples",
                found: cutoff_hz,
            });
        }
        let half = reach.floor() as usize;
        if half == 0 {
            return Ok(Self { cutoff_hz, rate_hz, weights: vec![1.0] });
        }
        let gauss = |n: usize| {
            let x = n.abs_diff(half) as f64 / sd;
            (-0.5 * x * x).exp()
        };
        let mut weights: Vec<f64> = (0..=2 * half).map(gauss).collect();
        let sum: f64 = weights.iter().sum();
        for w in &mut weights {
            *w /= sum;
        }
        Ok(Self { cutoff_hz, rate_hz, weights })
    }

    /// Nominal cut-off, Hz.
    pub fn cutoff_hz(&self) -> f64 {
        self.cutoff_hz
    }

    /// Weights, `2 half_width + 1` of them, symmetric.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Samples on either side of the centre.
    pub fn half_width(&self) -> usize {
        self.weights.len() / 2
    }

    /// Standard deviation in time, s.
    pub fn standard_deviation(&self) -> f64 {
        Self::standard_deviation_at(self.cutoff_hz)
    }

    /// Standard deviation in time of kernels of a nominal cut-off, s.
    pub fn standard_deviation_at(cutoff_hz: f64) -> f64 {
        SD_OF_CUTOFF / cutoff_hz
    }

    /// Distance of rows that are worth having, a quarter of `1 / cutoff`, samples (at least 1).
    pub fn spacing(&self) -> usize {
        ((0.25 * self.rate_hz / self.cutoff_hz).round() as usize).max(1)
    }

    /// Row centres `spacing` apart whose whole window lies in `samples` samples.
    pub fn centres(&self, samples: usize) -> Vec<usize> {
        let half = self.half_width();
        (half..samples.saturating_sub(half)).step_by(self.spacing()).collect()
    }

    /// Places of those of the ascending `centres` whose whole window lies in the block of `samples` that begins at `first`.
    pub fn covered(&self, centres: &[usize], first: usize, samples: usize) -> Range<usize> {
        let half = self.half_width();
        let start = centres.partition_point(|c| *c < first + half);
        let end = centres.partition_point(|c| c + half < first + samples);
        start..end.max(start)
    }

    /// Weighted mean about one sample. The window must lie inside the signal.
    pub fn apply_at(&self, signal: &[f64], centre: usize) -> f64 {
        let start = centre - self.half_width();
        dot(&self.weights, &signal[start..start + self.weights.len()])
    }

    /// Weighted means of one column of a block.
    ///
    /// `block` holds the samples from index `first` on; `centres` are indices of the same count, all
    /// [`covered`](Self::covered) by the block. `out`: one value per centre. A value depends on its window only, so it
    /// has the same bits whatever block it is computed from.
    pub fn apply_block(&self, block: &[f64], first: usize, centres: &[usize], out: &mut [f64]) {
        assert_eq!(centres.len(), out.len(), "one output per centre");
        for (y, centre) in out.iter_mut().zip(centres) {
            *y = self.apply_at(block, centre - first);
        }
    }

    /// Adds to weighted means what a block holds of their windows.
    ///
    /// `block` holds the samples from index `first` on; `centres` are ascending indices of the same count. `out`: one value per centre. A window that
    /// lies in the block as a whole adds the value of [`Self::apply_block`]; the parts of a window that lies in several blocks add up to it but for
    /// rounding.
    pub fn add_block(&self, block: &[f64], first: usize, centres: &[usize], out: &mut [f64]) {
        assert_eq!(centres.len(), out.len(), "one output per centre");
        let (half, end) = (self.half_width(), first + block.len());
        let touched =
            centres.partition_point(|c| c + half < first)..centres.partition_point(|c| *c < end + half);
        for (y, centre) in out[touched.clone()].iter_mut().zip(&centres[touched]) {
            // Index of the window's first sample is `centre - half`, which may lie before the block.
            let from = (first + half).saturating_sub(*centre);
            let to = self.weights.len().min(end + half - centre);
            let start = centre + from - half - first;
            *y += dot(&self.weights[from..to], &block[start..start + to - from]);
        }
    }

    /// Weighted means of several columns of a block.
    ///
    /// `columns`: column `c` in `columns[c * stride..(c + 1) * stride]`, beginning at sample `first` and of at most
    /// `stride` samples in use. `out`: column-major, `centres` rows by `n_columns`. Else as [`Self::apply_block`].
    pub fn apply_columns(
        &self,
        columns: &[f64],
        stride: usize,
        n_columns: usize,
        first: usize,
        centres: &[usize],
        out: &mut [f64],
    ) {
        assert_eq!(out.len(), n_columns * centres.len(), "one output per centre and column");
        if centres.is_empty() {
            return;
        }
        let blocks = columns.chunks(stride).take(n_columns);
        for (block, out) in blocks.zip(out.chunks_mut(centres.len())) {
            self.apply_block(block, first, centres, out);
        }
    }
}

/// Sum of products in eight interleaved sums, an order that the compiler turns into vector instructions.
fn dot(weights: &[f64], samples: &[f64]) -> f64 {
    const LANES: usize = 8;
    let (weight_lanes, weight_rest) = weights.as_chunks::<LANES>();
    let (sample_lanes, sample_rest) = samples.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for (w, x) in weight_lanes.iter().zip(sample_lanes) {
        for lane in 0..LANES {
            sums[lane] += w[lane] * x[lane];
        }
    }
    let rest: f64 = weight_rest.iter().zip(sample_rest).map(|(w, x)| w * x).sum();
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7])) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_a_cut_gaussian_of_sum_one() {
        let kernel = Kernel::new(10.0, 500.0).unwrap();
        let sd = 0.0265 * 500.0;
        assert_eq!(kernel.half_width(), (3.5f64 * sd).floor() as usize);
        let w = kernel.weights();
        assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        for k in 0..w.len() {
            assert_eq!(w[k], w[w.len() - 1 - k]);
        }
        let half = kernel.half_width();
        let ratio = w[half + 13] / w[half];
        assert!((ratio - (-0.5 * (13.0 / sd).powi(2)).exp()).abs() < 1e-14);
        assert_eq!(kernel.spacing(), 13);
    }

    #[test]
    fn straight_lines_pass_and_sines_droop_as_a_gaussian() {
        let kernel = Kernel::new(5.0, 400.0).unwrap();
        let line: Vec<f64> = (0..600).map(|n| 2.0 + 0.01 * f64::from(n)).collect();
        assert!((kernel.apply_at(&line, 300) - 5.0).abs() < 1e-12);
        let f = 3.0;
        let wave: Vec<f64> =
            (0..600).map(|n| (std::f64::consts::TAU * f * f64::from(n - 300) / 400.0).cos()).collect();
        let gain = (-2.0 * (std::f64::consts::PI * f * kernel.standard_deviation()).powi(2)).exp();
        // Cutting at 3.5 sd leaves 5e-4 of the area out.
        assert!((kernel.apply_at(&wave, 300) - gain).abs() < 1e-3);
    }

    #[test]
    fn blocks_give_the_same_bits_as_the_whole() {
        let kernel = Kernel::new(8.0, 250.0).unwrap();
        let signal: Vec<f64> = (0..900).map(|n| (f64::from(n) * 0.37).sin()).collect();
        let centres = kernel.centres(signal.len());
        let whole: Vec<f64> = centres.iter().map(|c| kernel.apply_at(&signal, *c)).collect();
        let overlap = 2 * kernel.half_width();
        let mut parts = vec![];
        let mut first = 0;
        while first + overlap < signal.len() {
            let end = (first + overlap + 101).min(signal.len());
            let inside = kernel.covered(&centres, first, end - first);
            let mut out = vec![0.0; inside.len() * 2];
            let columns = [&signal[first..end], &signal[first..end]].concat();
            kernel.apply_columns(&columns, end - first, 2, first, &centres[inside.clone()], &mut out);
            assert_eq!(out[..inside.len()], out[inside.len()..]);
            parts.extend_from_slice(&out[..inside.len()]);
            first += 101;
        }
        assert_eq!(parts, whole);
    }

    #[test]
    fn degenerate_kernels_are_the_identity_or_an_error() {
        let identity = Kernel::new(200.0, 100.0).unwrap();
        assert_eq!(identity.weights(), [1.0]);
        assert_eq!(identity.apply_at(&[4.0], 0), 4.0);
        assert!(Kernel::new(1e-12, 1000.0).is_err());
        assert!(Kernel::new(0.0, 1000.0).is_err());
        assert!(Kernel::new(f64::MIN_POSITIVE, f64::MAX).is_err());
        assert!(Kernel::new(10.0, 100.0).unwrap().centres(3).is_empty());
    }

    #[test]
    fn parts_of_windows_add_up() {
        let kernel = Kernel::new(5.0, 200.0).unwrap();
        let signal: Vec<f64> = (0..1000).map(|k| (0.37 * f64::from(k)).sin() + 0.01 * f64::from(k)).collect();
        let centres = kernel.centres(signal.len());
        let mut whole = vec![0.0; centres.len()];
        kernel.apply_block(&signal, 0, &centres, &mut whole);
        let mut once = vec![0.0; centres.len()];
        kernel.add_block(&signal, 0, &centres, &mut once);
        assert_eq!(once, whole);
        for length in [1, 17, 64, 333, 999] {
            let mut parts = vec![0.0; centres.len()];
            for (k, block) in signal.chunks(length).enumerate() {
                kernel.add_block(block, k * length, &centres, &mut parts);
            }
            // Weights sum to one: each of at most 1000 additions rounds a value of at most 11.
            let bound = 1000.0 * f64::EPSILON * 11.0;
            assert!(parts.iter().zip(&whole).all(|(a, b)| (a - b).abs() < bound), "{length}");
        }
    }
}
