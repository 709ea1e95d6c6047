//! Averages over the periods of a record.

use crate::signal::{SignalError, check_signal};

/// One period, the mean of several.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodAverage {
    /// The mean of every sample of the period.
    pub mean: Vec<f64>,
    /// Periods that were averaged.
    pub periods: usize,
    /// Standard deviation between periods, pooled over the samples of a period: what does not repeat. The mean's own is
    /// smaller by `√periods`. `None` for a single period.
    pub deviation: Option<f64>,
}

/// Averages the whole periods of a record of a motion that repeats every `period` samples, sample by sample. What is left
/// after the last whole period is not used.
///
/// `skip`: periods at the start that are left out, since the motion must have settled: one at least, if the record begins at
/// rest. Where the samples of a period are no whole number, fit harmonics instead
/// ([`frequency::differentiate`](crate::frequency::differentiate)).
///
/// # Errors
/// [`SignalError`] if no whole period is left, a sample is not finite, or `period` is 0.
pub fn average_periods(signal: &[f64], period: usize, skip: usize) -> Result<PeriodAverage, SignalError> {
    if period == 0 {
        return Err(SignalError::Setting { name: "period", expected: "at least 1 sample", found: 0.0 });
    }
    check_signal(signal, period.saturating_mul(skip.saturating_add(1)))?;
    let whole = signal[skip * period..].chunks_exact(period);
    let periods = whole.len();
    let mut mean = vec![0.0; period];
    for part in whole.clone() {
        mean.iter_mut().zip(part).for_each(|(m, x)| *m += x);
    }
    mean.iter_mut().for_each(|m| *m /= periods as f64);
    let squares: f64 = whole.flat_map(|part| part.iter().zip(&mean)).map(|(x, m)| (x - m).powi(2)).sum();
    let freedom = (periods - 1) * period;
    let deviation = (freedom > 0).then(|| (squares / freedom as f64).sqrt());
    Ok(PeriodAverage { mean, periods, deviation })
}
