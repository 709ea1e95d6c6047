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
    let mut derivative = Vec::with_capacity(n);
    derivative.push((signal[1] - signal[0]) * rate_hz);
    derivative.extend(signal.windows(3).map(|w| (w[2] - w[0]) * (0.5 * rate_hz)));
    derivative.push((signal[n - 1] - signal[n - 2]) * rate_hz);
    Ok(derivative)
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
    fn short_or_bad_signals_are_errors() {
        assert!(central(&[1.0], 1.0).is_err());
        assert!(central(&[1.0, f64::NAN], 1.0).is_err());
        assert!(central(&[1.0, 2.0], 0.0).is_err());
        assert_eq!(central(&[1.0, 1.0], 5.0).unwrap(), [0.0, 0.0]);
    }
}
