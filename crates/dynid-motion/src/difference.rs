//! Derivatives by differences.

use crate::signal::{SignalError, check_positive, check_signal};

/// Time derivative by central differences, `(x[n+1] - x[n-1]) rate / 2`, second order.
///
/// The two ends use the one-sided first-order difference, as NumPy's `gradient` does. Applied twice it gives the
/// second derivative over five samples. Fails if the rate is not positive, the signal is not finite or has fewer
/// than two samples.
pub fn central(signal: &[f64], rate_hz: f64) -> Result<Vec<f64>, SignalError> {
    check_positive("rate_hz", rate_hz)?;
    check_signal(signal, 2)?;
    let n = signal.len();
    let mut derivative = vec![0.0; n];
    central_part(signal, rate_hz, 0..n, &mut derivative);
    Ok(derivative)
}

/// Part of [`central`], the same bits: derivatives at the samples of `range`, from the whole signal.
///
/// Nothing is checked: a signal that is not finite or a rate that is not positive gives numbers that mean nothing.
///
/// # Panics
/// If `range` and `out` differ in length, `range` leaves the signal, or the signal has a single sample.
pub fn central_part(signal: &[f64], rate_hz: f64, range: std::ops::Range<usize>, out: &mut [f64]) {
    assert_eq!(range.len(), out.len(), "length of the derivative");
    let n = signal.len();
    if range.is_empty() {
        return;
    }
    let inner = range.start.max(1)..range.end.min(n - 1);
    if !inner.is_empty() {
        let windows = signal[inner.start - 1..=inner.end].windows(3);
        for (to, w) in out[inner.start - range.start..].iter_mut().zip(windows) {
            *to = (w[2] - w[0]) * (0.5 * rate_hz);
        }
    }
    if range.start == 0 {
        out[0] = (signal[1] - signal[0]) * rate_hz;
    }
    if range.end == n {
        out[n - 1 - range.start] = (signal[n - 1] - signal[n - 2]) * rate_hz;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parabolas_are_exact_inside() {
        let rate = 8.0;
        let x: Vec<f64> = (0..20).map(|n| (f64::from(n) / rate).powi(2)).collect();
        let v = central(&x, rate).unwrap();
        for (n, v) in v.iter().enumerate().skip(1).take(18) {
            assert_eq!(*v, 2.0 * n as f64 / rate);
        }
        assert_eq!((v[0], v[19]), (x[1] * rate, (x[19] - x[18]) * rate));
    }

    #[test]
    fn parts_are_those_of_the_whole() {
        let x: Vec<f64> = (0..40).map(|n| (0.7 * f64::from(n)).sin()).collect();
        let whole = central(&x, 3.0).unwrap();
        for start in 0..40 {
            for end in start..=40 {
                let mut part = vec![0.0; end - start];
                central_part(&x, 3.0, start..end, &mut part);
                assert_eq!(part, whole[start..end], "{start}..{end}");
            }
        }
    }

    #[test]
    fn short_or_bad_signals_are_errors() {
        assert!(central(&[1.0], 1.0).is_err());
        assert!(central(&[1.0, f64::NAN], 1.0).is_err());
        assert!(central(&[1.0, 2.0], 0.0).is_err());
        assert_eq!(central(&[1.0, 1.0], 5.0).unwrap(), [0.0, 0.0]);
    }
}
