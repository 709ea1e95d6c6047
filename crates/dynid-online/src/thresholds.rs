//! Thresholds of the cumulative sum for a wanted rate of false alarms.

use alloc::vec;
use alloc::vec::Vec;

use crate::distribution::chi_squared_probability;

/// States of the chain.
const STATES: usize = 400;

/// Mean number of samples to a false alarm of the cumulative sum
/// `g ← max(0, g + ½ [(1 - 1/κ) χ²_m - m ln κ])` with `m = rows` and alarm at `g ≥ threshold`.
///
/// The continuous sum becomes a Markov chain of 400 states, `ARL = [(1 - Q)⁻¹ 1]_0`. Clipping of single terms
/// is left out, which is on the safe side.
///
/// Needs `rows ≥ 1`, `κ > 1` and a positive threshold. Allocates. Source: Brook & Evans 1972.
pub fn average_run_length(rows: usize, kappa: f64, threshold: f64) -> f64 {
    let n = STATES;
    let width = threshold / (n as f64 - 0.5);
    let (slope, fall) = (0.5 * (1.0 - 1.0 / kappa), 0.5 * rows as f64 * libm::log(kappa));
    // One sample takes state i to at most j with probability below[j - i + n].
    let below: Vec<f64> = (0..=2 * n)
        .map(|k| (((k as f64 - n as f64 + 0.5) * width) + fall) / slope)
        .map(|value| chi_squared_probability(value, rows as f64))
        .collect();
    let band = (libm::ceil(fall / width) as usize + 1).min(n - 1);
    let mut system = vec![0.0; n * n];
    for (i, row) in system.chunks_exact_mut(n).enumerate() {
        for (j, entry) in row.iter_mut().enumerate().skip(i.saturating_sub(band)) {
            let stays = if j == 0 { below[n - i] } else { below[n + j - i] - below[n + j - i - 1] };
            *entry = if i == j { 1.0 - stays } else { -stays };
        }
    }
    let mut lengths = vec![1.0; n];
    // An M-matrix needs no pivoting, and nothing lies more than `band` below the diagonal.
    for k in 0..n {
        let (done, later) = system.split_at_mut((k + 1) * n);
        let pivot = &done[k * n + k..];
        for (below, row) in later.chunks_exact_mut(n).take(band).enumerate() {
            let factor = row[k] / pivot[0];
            row[k..].iter_mut().zip(pivot).for_each(|(r, p)| *r -= factor * p);
            lengths[k + 1 + below] -= factor * lengths[k];
        }
    }
    for k in (0..n).rev() {
        let tail: f64 =
            system[k * n + k + 1..(k + 1) * n].iter().zip(&lengths[k + 1..]).map(|(a, l)| a * l).sum();
        lengths[k] = (lengths[k] - tail) / system[k * n + k];
    }
    lengths[0]
}

/// Threshold of the cumulative sum for a mean of `run_length` samples to a false alarm; see
/// [`average_run_length`].
///
/// Secant steps on the logarithm of the run length, which is nearly linear in the threshold. `ln(run_length)`
/// would be safe but 25 to 50 % too large (Lorden 1971).
pub fn cusum_threshold(rows: usize, kappa: f64, run_length: f64) -> f64 {
    let target = libm::log(run_length.max(2.0));
    let excess = |h: f64| libm::log(average_run_length(rows, kappa, h)) - target;
    let (mut a, mut b) = (0.75 * target, 0.9 * target);
    let (mut at_a, mut at_b) = (excess(a), excess(b));
    for _ in 0..20 {
        if at_b.abs() < 1e-6 || at_a == at_b {
            break;
        }
        let next = (b - at_b * (b - a) / (at_b - at_a)).clamp(0.05 * target, 2.0 * target);
        (a, at_a) = (b, at_b);
        (b, at_b) = (next, excess(next));
    }
    b
}

/// Mean run length with which `samples` change-free samples raise an alarm with probability `rate`:
/// `samples/(-ln(1 - rate))`.
pub fn run_length_for_rate(rate: f64, samples: f64) -> f64 {
    samples / -libm::log1p(-rate)
}
