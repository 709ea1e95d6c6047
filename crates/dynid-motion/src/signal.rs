//! What every operation on a sampled signal asks of its input.

/// Why a signal or a setting was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SignalError {
    /// The signal is shorter than the operation needs.
    #[error("signal too short: expected at least {expected} samples, found {found}")]
    TooShort {
        /// Samples needed.
        expected: usize,
        /// Samples given.
        found: usize,
    },
    /// A sample is NaN or infinite.
    #[error("sample {sample}: expected a finite number, found {found}")]
    NotFinite {
        /// Index of the first offending sample, from 0.
        sample: usize,
        /// Value of that sample.
        found: f64,
    },
    /// Two signals that belong together have different lengths.
    #[error("{what}: expected {expected} samples, found {found}")]
    Length {
        /// Name of the signal.
        what: &'static str,
        /// Samples expected.
        expected: usize,
        /// Samples given.
        found: usize,
    },
    /// A setting is outside its range.
    #[error("{name}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// The range it must lie in.
        expected: &'static str,
        /// The value given.
        found: f64,
    },
}

/// Fails if a sample is NaN or infinite.
pub fn check_finite(signal: &[f64]) -> Result<(), SignalError> {
    match signal.iter().position(|x| !x.is_finite()) {
        Some(sample) => Err(SignalError::NotFinite { sample, found: signal[sample] }),
        None => Ok(()),
    }
}

/// Fails if the signal has fewer than `expected` samples or a sample is not finite.
pub fn check_signal(signal: &[f64], expected: usize) -> Result<(), SignalError> {
    if signal.len() < expected {
        return Err(SignalError::TooShort { expected, found: signal.len() });
    }
    check_finite(signal)
}

/// Fails unless `found` is positive and finite.
pub fn check_positive(name: &'static str, found: f64) -> Result<(), SignalError> {
    if found > 0.0 && found.is_finite() {
        Ok(())
    } else {
        Err(SignalError::Setting { name, expected: "a positive finite number", found })
    }
}

/// Fails unless `0 < cutoff_hz < rate_hz / 2` and the rate is positive and finite.
pub fn check_cutoff(cutoff_hz: f64, rate_hz: f64) -> Result<(), SignalError> {
    check_positive("rate_hz", rate_hz)?;
    if cutoff_hz > 0.0 && cutoff_hz < 0.5 * rate_hz {
        return Ok(());
    }
    Err(SignalError::Setting {
        name: "cutoff_hz",
        expected: "more than 0 and less than half the sample rate",
        found: cutoff_hz,
    })
}

/// Smallest non-zero step between neighbouring samples: the resolution of a quantised signal. Zero if constant.
pub fn quantum(signal: &[f64]) -> f64 {
    let smallest = signal
        .windows(2)
        .map(|w| (w[1] - w[0]).abs())
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if smallest.is_finite() { smallest } else { 0.0 }
}

/// Largest absolute value; 0 for an empty signal.
pub fn largest(signal: &[f64]) -> f64 {
    signal.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// Root mean square; 0 for an empty signal.
pub fn rms(signal: &[f64]) -> f64 {
    if signal.is_empty() {
        return 0.0;
    }
    (signal.iter().map(|x| x * x).sum::<f64>() / signal.len() as f64).sqrt()
}

/// Root mean square over the samples that count, one flag per sample; 0 if none does.
///
/// # Panics
/// If there is not one flag per sample.
pub fn rms_where(signal: &[f64], counts: &[bool]) -> f64 {
    assert_eq!(signal.len(), counts.len(), "flags of samples");
    let (mut square, mut samples) = (0.0, 0_usize);
    for (x, _) in signal.iter().zip(counts).filter(|(_, counts)| **counts) {
        square += x * x;
        samples += 1;
    }
    (square / samples.max(1) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn first_bad_sample_is_named() {
        let error = check_finite(&[0.0, 1.0, f64::INFINITY, f64::NAN]).unwrap_err();
        assert_eq!(error.to_string(), "sample 2: expected a finite number, found inf");
    }

    #[test]
    fn cutoff_must_lie_below_nyquist() {
        assert!(check_cutoff(49.9, 100.0).is_ok());
        for bad in [0.0, -1.0, 50.0, f64::NAN, f64::INFINITY] {
            assert!(check_cutoff(bad, 100.0).is_err(), "{bad}");
        }
        assert!(check_cutoff(1.0, f64::NAN).is_err());
    }

    #[test]
    fn samples_that_do_not_count_are_left_out_of_a_mean() {
        let signal = [3.0, 100.0, 4.0, f64::NAN];
        assert_eq!(rms_where(&signal, &[true, false, true, false]), 12.5_f64.sqrt());
        assert_eq!(rms_where(&signal, &[false; 4]), 0.0);
        assert_eq!((rms(&[3.0, 4.0]), rms(&[])), (12.5_f64.sqrt(), 0.0));
    }

    #[test]
    fn quantum_is_the_encoder_step() {
        assert_eq!(quantum(&[0.0, 0.5, 0.5, 2.0, 1.75]), 0.25);
        assert_eq!(quantum(&[3.0; 5]), 0.0);
    }
}
