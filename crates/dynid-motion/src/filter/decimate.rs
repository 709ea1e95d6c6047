//! Decimation.

use super::{chebyshev, forward_backward};
use crate::signal::{SignalError, check_finite};

/// Which sample survives decimation for certain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Alignment {
    /// The first, as in SciPy's `decimate`.
    #[default]
    First,
    /// The last, as in MATLAB's `decimate`; the first kept is `(samples - 1) % factor`.
    Last,
}

/// Anti-alias filter and every `factor`-th sample. Factor 1 returns the signal. Fails as [`anti_alias`] does.
pub fn decimate(signal: &[f64], factor: usize, alignment: Alignment) -> Result<Vec<f64>, SignalError> {
    let filtered = anti_alias(signal, factor)?;
    let first = match alignment {
        Alignment::First => 0,
        Alignment::Last => filtered.len().saturating_sub(1) % factor,
    };
    Ok(pick(&filtered, factor, first))
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
