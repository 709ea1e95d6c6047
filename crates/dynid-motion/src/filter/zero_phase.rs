//! Forward-backward filtering.

use super::sections::{Run, Sections};
use crate::signal::{SignalError, check_signal};

/// Signals that are filtered in step.
const LANES: usize = 4;

/// Runs the filter forward and backward: zero phase, squared magnitude (-6 dB at the cut-off).
///
/// The ends are extended by their own point reflection (`2 x_0 - x_k`, [`Sections::padding`] samples) and each run
/// starts in the steady state of its first sample, as SciPy's `sosfiltfilt` does with its default padding. About
/// `1 / cutoff` at either end depends on that extension. Fails if the signal is not longer than the padding or not
/// finite.
pub fn forward_backward(filter: &Sections, signal: &[f64]) -> Result<Vec<f64>, SignalError> {
    let [out] = forward_backward_in_step(filter, [signal])?;
    Ok(out)
}

/// [`forward_backward`] of a few signals of one length, the same bits in the time of one.
///
/// # Errors
/// That of the first signal which [`forward_backward`] refuses.
///
/// # Panics
/// If the signals differ in length.
pub fn forward_backward_in_step<const N: usize>(
    filter: &Sections,
    signals: [&[f64]; N],
) -> Result<[Vec<f64>; N], SignalError> {
    // The filter itself is compiled here alone, not with whoever asks for so many signals.
    let mut filtered = forward_backward_all(filter, &signals)?.into_iter();
    Ok(signals.map(|_| filtered.next().unwrap_or_default()))
}

/// [`forward_backward_in_step`] of any number of signals.
///
/// # Errors
/// That of the first signal which [`forward_backward`] refuses.
///
/// # Panics
/// If the signals differ in length.
pub fn forward_backward_all(filter: &Sections, signals: &[&[f64]]) -> Result<Vec<Vec<f64>>, SignalError> {
    signals.iter().try_for_each(|signal| check_signal(signal, filter.padding() + 1))?;
    let (groups, rest) = signals.as_chunks::<LANES>();
    let mut out = Vec::with_capacity(signals.len());
    for group in groups {
        out.extend(in_step(filter, *group));
    }
    match *rest {
        [a, b, c] => out.extend(in_step(filter, [a, b, c])),
        [a, b] => out.extend(in_step(filter, [a, b])),
        [a] => out.extend(in_step(filter, [a])),
        _ => {}
    }
    Ok(out)
}

/// Filters checked signals.
fn in_step<const N: usize>(filter: &Sections, signals: [&[f64]; N]) -> [Vec<f64>; N] {
    let padding = filter.padding();
    let mut before = signals.map(|signal| {
        let first = signal[0];
        signal[1..=padding].iter().rev().map(|x| 2.0 * first - x).collect::<Vec<f64>>()
    });
    let mut after = signals.map(|signal| {
        let (n, last) = (signal.len(), signal[signal.len() - 1]);
        signal[n - 1 - padding..n - 1].iter().rev().map(|x| 2.0 * last - x).collect::<Vec<f64>>()
    });
    let mut out = signals.map(<[f64]>::to_vec);
    let mut run = Run::new(filter, before.each_ref().map(|signal| signal[0]));
    for part in [&mut before, &mut out, &mut after] {
        run.forward(part.each_mut().map(Vec::as_mut_slice));
    }
    // What lies before the first sample is not needed on the way back.
    let mut run = Run::new(filter, after.each_ref().map(|signal| signal[padding - 1]));
    for part in [&mut after, &mut out] {
        run.backward(part.each_mut().map(Vec::as_mut_slice));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::filter::{butterworth, chebyshev};

    /// The signal with its ends, filtered, turned round, filtered and turned back.
    fn by_definition(filter: &Sections, signal: &[f64]) -> Vec<f64> {
        let (padding, n) = (filter.padding(), signal.len());
        let before = (1..=padding).rev().map(|k| 2.0 * signal[0] - signal[k]);
        let after = (1..=padding).map(|k| 2.0 * signal[n - 1] - signal[n - 1 - k]);
        let mut all: Vec<f64> = before.chain(signal.iter().copied()).chain(after).collect();
        for _ in 0..2 {
            let first = all[0];
            filter.run(&mut all, first);
            all.reverse();
        }
        all[padding..padding + n].to_vec()
    }

    #[test]
    fn signals_in_step_have_the_bits_of_one_alone() {
        let filters =
            [butterworth(2, 20.0, 500.0), butterworth(4, 30.0, 500.0), chebyshev(6, 0.1, 40.0, 500.0)];
        for filter in filters.map(Result::unwrap) {
            for count in 0..10 {
                let signals: Vec<Vec<f64>> = (0..count)
                    .map(|j| (0..90).map(|n| (0.3 * f64::from(n * (j + 1))).sin()).collect())
                    .collect();
                let expected: Vec<Vec<f64>> = signals.iter().map(|s| by_definition(&filter, s)).collect();
                let slices: Vec<&[f64]> = signals.iter().map(Vec::as_slice).collect();
                assert_eq!(forward_backward_all(&filter, &slices).unwrap(), expected);
                for (signal, expected) in signals.iter().zip(expected) {
                    assert_eq!(forward_backward(&filter, signal).unwrap(), expected);
                }
            }
        }
    }

    #[test]
    fn the_first_bad_signal_is_the_error() {
        let filter = butterworth(4, 10.0, 100.0).unwrap();
        let (good, bad) = (vec![1.0; 40], [vec![0.0; 30], vec![f64::NAN], vec![0.0; 9]].concat());
        let error = forward_backward_all(&filter, &[&good, &bad, &[]]).unwrap_err();
        assert!(matches!(error, SignalError::NotFinite { sample: 30, .. }), "{error}");
    }
}
