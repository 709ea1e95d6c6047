//! Decimation.

use super::{chebyshev, forward_backward};
use crate::signal::{SignalError, check_finite};

/// Anti-alias filter and every `factor`-th sample from the first, as SciPy's and (but for the first sample kept)
/// MATLAB's `decimate`.
///
/// MATLAB aligns on the last sample: `pick(&anti_alias(x, k)?, k, (x.len() - 1) % k)`. Factor 1 returns the signal.
/// Fails as [`anti_alias`] does.
pub fn decimate(signal: &[f64], factor: usize) -> Result<Vec<f64>, SignalError> {
    Ok(pick(&anti_alias(signal, factor)?, factor, 0))
}

/// Zero-phase Chebyshev type I low-pass, order 8, 0.05 dB, ending at `0.8 / factor` of Nyquist.
///
/// Fails if the factor is zero, the signal is not finite or (for factors above 1) has fewer than 28 samples.
pub fn anti_alias(signal: &[f64], factor: usize) -> Result<Vec<f64>, SignalError> {
    match factor {
        0 => Err(SignalError::Setting { name: "decimation factor", expected: "at least 1", found: 0.0 }),
        1 => check_finite(signal).map(|()| signal.to_vec()),
        _ => forward_backward(&chebyshev(8, 0.05, 0.8 / factor as f64, 2.0)?, signal),
    }
}

/// Every `factor`-th sample (`factor` at least 1) from index `first` on.
pub fn pick<T: Copy>(signal: &[T], factor: usize, first: usize) -> Vec<T> {
    signal.iter().skip(first).step_by(factor.max(1)).copied().collect()
}
