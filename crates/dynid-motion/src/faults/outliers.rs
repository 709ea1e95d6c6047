//! Single positions off the line between their neighbours.

use super::high_quantile;
use crate::median::median;
use crate::signal::quantum;

/// Standard deviations of the distance from that line that no noise reaches.
const THRESHOLD: f64 = 30.0;
/// 99 % quantiles of the distance that are no motion and no stumbling clock.
const QUANTILES: f64 = 5.0;
/// Resolution steps that count at least.
const STEPS: f64 = 8.0;

/// Samples that lie off the mean of both neighbours by 30 robust standard deviations of that distance, by 5 times its 99 %
/// quantile and by 8 resolution steps, and whose neighbours are off by half as much the other way, as they are beside a single wrong sample and nowhere
/// along a motion.
pub fn outliers(position: &[f64]) -> Vec<usize> {
    let bend: Vec<f64> = position.windows(3).map(|w| w[1] - 0.5 * (w[0] + w[2])).collect();
    let sizes: Vec<f64> = bend.iter().map(|b| b.abs()).collect();
    let spread = 1.4826 * median(&sizes).unwrap_or(0.0);
    let least =
        (THRESHOLD * spread).max(QUANTILES * high_quantile(sizes.clone())).max(STEPS * quantum(position));
    let is_half = |of: f64, beside: f64| (-beside / of - 0.5).abs() < 0.25;
    (1..bend.len().saturating_sub(1))
        .filter(|k| sizes[*k] > least && is_half(bend[*k], bend[k - 1]) && is_half(bend[*k], bend[k + 1]))
        .map(|k| k + 1)
        .collect()
}
