//! Length of a journal's offset from the swing that the effort of a drive shows.
//!
//! A journal in its clearance is a pendulum as long as its offset: `ω² = a √(1 + μ²)/|e|` with the apparent gravity `a` of
//! what the journal carries, at right angles to the joint's axis (load over mass: both masses cancel). The root is what
//! sliding friction adds: with the load at the angle of friction to the offset, a swing by `ψ` changes the normal force by
//! `μ F_n ψ` and so friction by `μ² F_n ψ`, against the swing, beside `F_n ψ` with `F_n = |F|/√(1 + μ²)`. Impacts and reversals of
//! friction set it swinging, and saturated friction does not damp it. Where the effort is sampled fast enough, its residual
//! holds the swing, however small, as a line.
//!
//! The phase `θ(t; ℓ) = ∫ √(a/ℓ) dt` of every candidate length `ℓ` follows the apparent gravity. Phases begin anew in every
//! block, since each kick sets another, so powers of blocks add: `P(ℓ) = Σ_blocks |Σ r w e^{-iθ}|²`, with a window `w`. The length
//! that takes most power is refined by golden sections, its deviation comes from leaving out blocks.

use super::Estimate;

/// Settings of [`estimate`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SwingSettings {
    /// Candidates, shortest and longest, m. Default: 5 µm to 1 mm.
    pub range: (f64, f64),
    /// Length of a block, s. Default: 1.
    pub block_s: f64,
    /// Friction coefficient `μ` of the bearing. Default: 0.
    pub friction: f64,
}

impl Default for SwingSettings {
    fn default() -> Self {
        SwingSettings { range: (5e-6, 1e-3), block_s: 1.0, friction: 0.0 }
    }
}

/// Why no swing can be looked for.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SwingError {
    /// Lists of other lengths, or too short for four blocks.
    #[error(
        "expected residual and apparent gravity of at least four blocks ({expected} samples each), found {found}"
    )]
    TooShort {
        /// Samples needed.
        expected: usize,
        /// Samples given.
        found: usize,
    },
    /// A number is not finite, or gravity vanishes.
    #[error("sample {row}: expected a finite residual and an apparent gravity above 0")]
    BadSample {
        /// Index from 0.
        row: usize,
    },
    /// The samples are too slow for any candidate.
    #[error(
        "samples every {step_s} s show no swing of journals with offsets from {shortest} to {longest} m: at least {needed_hz:.0} Hz are needed"
    )]
    TooSlow {
        /// Time between samples, s.
        step_s: f64,
        /// Shortest candidate, m.
        shortest: f64,
        /// Longest candidate, m.
        longest: f64,
        /// Sample rate for the longest, Hz.
        needed_hz: f64,
    },
}

/// A swing found in the effort of a drive.
#[derive(Debug, Clone, PartialEq)]
pub struct SwingEstimate {
    /// Length of the offset, clearance and penetration together, m.
    pub length: Estimate,
    /// Frequency at the mean apparent gravity, Hz.
    pub frequency_hz: f64,
    /// Root of the mean square of the swing's effort.
    pub amplitude: f64,
    /// Power of the line over the median power of all candidates.
    pub prominence: f64,
    /// Whether noise alone gives this prominence in fewer than one of a thousand records.
    pub found: bool,
    /// Blocks.
    pub blocks: usize,
    /// Shortest length whose swing the samples can show, m.
    pub shortest: f64,
}

/// Samples per period that a swing must have.
const SAMPLES_PER_PERIOD: f64 = 2.5;

/// Looks for the swing of a journal in the residual of an effort.
///
/// `residual`: effort minus that of a model without clearance, at equal steps `step_s`, slow motion of joints removed by that
/// model. `gravity`: apparent gravity of what the journal carries at right angles to the axis, m/s². Lengths too short for
/// the sample rate are left out, and `shortest` says which.
///
/// # Errors
/// [`SwingError`].
pub fn estimate(
    residual: &[f64],
    gravity: &[f64],
    step_s: f64,
    settings: &SwingSettings,
) -> Result<SwingEstimate, SwingError> {
    let block = ((settings.block_s / step_s).round() as usize).max(8);
    let blocks = residual.len() / block;
    if blocks < 4 || gravity.len() != residual.len() {
        let found = residual.len().min(gravity.len());
        return Err(SwingError::TooShort { expected: 4 * block, found });
    }
    let good = |k: &usize| residual[*k].is_finite() && gravity[*k].is_finite() && gravity[*k] > 0.0;
    if let Some(row) = (0..residual.len()).find(|k| !good(k)) {
        return Err(SwingError::BadSample { row });
    }
    let stiffer = (1.0 + settings.friction * settings.friction).sqrt();
    let gravity: Vec<f64> = gravity.iter().map(|a| stiffer * a).collect();
    let gravity = gravity.as_slice();
    let strongest = gravity.iter().copied().fold(0.0, f64::max);
    let mean = gravity.iter().sum::<f64>() / gravity.len() as f64;
    // ω < 2π/(SAMPLES_PER_PERIOD step).
    let fastest = std::f64::consts::TAU / (SAMPLES_PER_PERIOD * step_s);
    let limit = strongest / (fastest * fastest);
    let (shortest, longest) = (settings.range.0.max(limit), settings.range.1);
    if shortest >= longest {
        let frequency = (strongest / longest).sqrt() / std::f64::consts::TAU;
        return Err(SwingError::TooSlow {
            step_s,
            shortest: settings.range.0,
            longest,
            needed_hz: SAMPLES_PER_PERIOD * frequency,
        });
    }
    // Candidates equally spaced in frequency, four to the width of a block's line.
    let slowest = (mean / longest).sqrt();
    let spacing = std::f64::consts::TAU / (4.0 * block as f64 * step_s);
    let count = (((mean / shortest).sqrt() - slowest) / spacing).floor() as usize + 1;
    let speeds: Vec<f64> = (0..count).map(|k| slowest + spacing * k as f64).collect();
    let record = Record::new(residual, gravity, mean, step_s, block, blocks);
    let powers: Vec<Vec<f64>> = speeds.iter().map(|w| record.powers(*w)).collect();
    let totals: Vec<f64> = powers.iter().map(|p| p.iter().sum()).collect();
    let best = (0..count).fold(0, |m, k| if totals[k] > totals[m] { k } else { m });
    let refined = |left_out: Option<usize>| {
        let total = |w: f64| {
            let p = record.powers(w);
            p.iter().enumerate().filter(|(b, _)| Some(*b) != left_out).map(|(_, p)| p).sum::<f64>()
        };
        peak(speeds[best], spacing, total)
    };
    let speed = refined(None);
    let length = mean / (speed * speed);
    let lengths: Vec<f64> = (0..blocks).map(|b| mean / refined(Some(b)).powi(2)).collect();
    let centre = lengths.iter().sum::<f64>() / blocks as f64;
    let spread: f64 = lengths.iter().map(|l| (l - centre).powi(2)).sum();
    let mut sorted = totals.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted[count / 2].max(f64::MIN_POSITIVE);
    let at_peak: f64 = record.powers(speed).iter().sum();
    let prominence = at_peak / median;
    // Sums of powers of white noise are gamma distributed with one shape per block; their mean is close to the median.
    let bound = noise_bound(blocks as f64, count as f64);
    Ok(SwingEstimate {
        length: Estimate { value: length, std: (spread * (blocks - 1) as f64 / blocks as f64).sqrt() },
        frequency_hz: speed / std::f64::consts::TAU,
        amplitude: ((at_peak - median).max(0.0) / record.gain).sqrt(),
        prominence,
        found: prominence > bound,
        blocks,
        shortest,
    })
}

/// Largest mean of `blocks` unit exponentials among `count` draws that one record of a thousand exceeds, by Chernoff's bound
/// `P(mean > x) <= e^{-blocks (x - 1 - ln x)}`.
fn noise_bound(blocks: f64, count: f64) -> f64 {
    let exponent = (1000.0 * count).ln() / blocks;
    let (mut low, mut high) = (1.0, 2.0);
    while high - 1.0 - f64::ln(high) < exponent {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if middle - 1.0 - f64::ln(middle) < exponent { low = middle } else { high = middle }
    }
    high
}

/// Where a smooth function near a grid's best value is largest, by golden sections over the two cells beside it.
fn peak(centre: f64, spacing: f64, f: impl Fn(f64) -> f64) -> f64 {
    let ratio = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (centre - spacing, centre + spacing);
    let (mut a, mut b) = (high - ratio * (high - low), low + ratio * (high - low));
    let (mut at_a, mut at_b) = (f(a), f(b));
    for _ in 0..40 {
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - ratio * (high - low);
            at_a = f(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + ratio * (high - low);
            at_b = f(b);
        }
    }
    0.5 * (low + high)
}

/// Residuals of blocks, windowed, with the warped time of their samples.
struct Record {
    /// Block after block.
    values: Vec<f64>,
    /// `∫ √(a/ā) dt` from the block's start.
    warped: Vec<f64>,
    block: usize,
    /// Power of a unit mean square of a line.
    gain: f64,
}

impl Record {
    fn new(residual: &[f64], gravity: &[f64], mean: f64, step_s: f64, block: usize, blocks: usize) -> Self {
        let window: Vec<f64> = (0..block)
            .map(|k| 0.5 - 0.5 * (std::f64::consts::TAU * (k as f64 + 0.5) / block as f64).cos())
            .collect();
        let sum: f64 = window.iter().sum();
        let (mut values, mut warped) = (Vec::new(), Vec::new());
        for b in 0..blocks {
            let rows = b * block..(b + 1) * block;
            let centre = residual[rows.clone()].iter().sum::<f64>() / block as f64;
            let mut time = 0.0;
            for (k, row) in rows.enumerate() {
                values.push(window[k] * (residual[row] - centre));
                warped.push(time);
                time += (gravity[row] / mean).sqrt() * step_s;
            }
        }
        Record { values, warped, block, gain: 0.5 * sum * sum * blocks as f64 }
    }

    /// Power of every block at an angular frequency of the warped time.
    fn powers(&self, w: f64) -> Vec<f64> {
        self.values
            .chunks_exact(self.block)
            .zip(self.warped.chunks_exact(self.block))
            .map(|(values, warped)| {
                let (mut re, mut im) = (0.0, 0.0);
                for (x, t) in values.iter().zip(warped) {
                    let (sine, cosine) = (w * t).sin_cos();
                    re += x * cosine;
                    im += x * sine;
                }
                re * re + im * im
            })
            .collect()
    }
}
