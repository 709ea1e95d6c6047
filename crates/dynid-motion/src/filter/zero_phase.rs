//! Forward-backward filtering.

use super::sections::Sections;
use crate::signal::{SignalError, check_signal};

/// Runs the filter forward and backward: zero phase, squared magnitude (-6 dB at the cut-off).
///
/// The ends are extended by their own point reflection (`2 x_0 - x_k`, [`Sections::padding`] samples) and each run
/// starts in the steady state of its first sample, as SciPy's `sosfiltfilt` does with its default padding. About
/// `1 / cutoff` at either end depends on that extension. Fails if the signal is not longer than the padding or not
/// finite.
pub fn forward_backward(filter: &Sections, signal: &[f64]) -> Result<Vec<f64>, SignalError> {
    let padding = filter.padding();
    check_signal(signal, padding + 1)?;
    let mut extended = extend(signal, padding);
    let first = extended[0];
    filter.run(&mut extended, first);
    extended.reverse();
    let last = extended[0];
    filter.run(&mut extended, last);
    extended.reverse();
    extended.truncate(padding + signal.len());
    extended.drain(..padding);
    Ok(extended)
}

fn extend(signal: &[f64], padding: usize) -> Vec<f64> {
    let n = signal.len();
    let (first, last) = (signal[0], signal[n - 1]);
    let before = signal[1..=padding].iter().rev().map(|x| 2.0 * first - x);
    let after = signal[n - 1 - padding..n - 1].iter().rev().map(|x| 2.0 * last - x);
    before.chain(signal.iter().copied()).chain(after).collect()
}
