//! Shift of a uniform signal by a fraction of a sample.

use std::ops::Range;

use crate::signal::{SignalError, check_finite, check_signal};

/// Offsets of the six nodes from the sample below the wanted time.
const NODES: [f64; 6] = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0];

/// Weights `L_m(d)` of 6-point Lagrange interpolation: `x(n + d) = sum_m L_m(d) x[n - 2 + m]`, `m = 0..6`.
///
/// Meant for `0 <= d < 1`, where the error is smallest; exact for polynomials up to degree 5 at any `d`.
pub fn lagrange(d: f64) -> [f64; 6] {
    std::array::from_fn(|m| others(m).map(|k| (d - NODES[k]) / (NODES[m] - NODES[k])).product())
}

/// Derivatives `dL_m/dd` of the weights, per sample.
pub fn lagrange_derivative(d: f64) -> [f64; 6] {
    std::array::from_fn(|m| {
        let scale: f64 = others(m).map(|k| NODES[m] - NODES[k]).product();
        let sum: f64 = others(m)
            .map(|left| others(m).filter(|k| *k != left).map(|k| d - NODES[k]).product::<f64>())
            .sum();
        sum / scale
    })
}

fn others(m: usize) -> impl Iterator<Item = usize> {
    (0..NODES.len()).filter(move |k| *k != m)
}

/// A shifted signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Shifted {
    /// One value per sample of the original.
    pub values: Vec<f64>,
    /// Samples whose six nodes all exist; outside, the end values were repeated.
    pub valid: Range<usize>,
}

/// The signal `samples` later: `values[n] = x(n + samples)`, negative to look back.
///
/// An effort logged as `effort(t - d)` against the motion at `t` is aligned by `shift(effort, -d rate)`. Past the ends
/// the end values are repeated. Fails if the signal is empty or a number is not finite.
pub fn shift(signal: &[f64], samples: f64) -> Result<Shifted, SignalError> {
    interpolate(signal, samples, lagrange)
}

/// Derivative of the shifted signal by the shift, per sample: `values[n] = dx/dn (n + samples)`.
///
/// Ends and errors as [`shift`].
pub fn shift_derivative(signal: &[f64], samples: f64) -> Result<Shifted, SignalError> {
    interpolate(signal, samples, lagrange_derivative)
}

fn interpolate(
    signal: &[f64],
    samples: f64,
    weights: impl Fn(f64) -> [f64; 6],
) -> Result<Shifted, SignalError> {
    check_signal(signal, 1)?;
    check_finite(&[samples])?;
    let n = signal.len() as i64;
    // Beyond the ends every shift gives the same repeated end value, so the whole part may be clamped.
    let reach = n as f64 + 8.0;
    let samples = samples.clamp(-reach, reach);
    let whole = samples.floor();
    let weights = weights(samples - whole);
    let whole = whole as i64;
    let at = |k: i64| signal[k.clamp(0, n - 1) as usize];
    let near_end = |k: i64| weights.iter().zip(k + whole - 2..).map(|(w, node)| w * at(node)).sum::<f64>();
    let start = (2 - whole).clamp(0, n);
    let end = (n - 3 - whole).clamp(start, n);
    let mut values: Vec<f64> = (0..start).map(near_end).collect();
    values.reserve_exact((n - start) as usize);
    if start < end {
        let inside = &signal[(start + whole - 2) as usize..(end + whole + 3) as usize];
        let sum = |nodes: &[f64]| weights.iter().zip(nodes).map(|(w, x)| w * x).sum::<f64>();
        values.extend(inside.windows(weights.len()).map(sum));
    }
    values.extend((end..n).map(near_end));
    Ok(Shifted { values, valid: start as usize..end as usize })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn quintic(t: f64) -> (f64, f64) {
        let value = 1.0 + t * (0.3 + t * (-0.2 + t * (0.05 + t * (0.01 - 0.002 * t))));
        let slope = 0.3 + t * (-0.4 + t * (0.15 + t * (0.04 - 0.01 * t)));
        (value, slope)
    }

    proptest! {
        #[test]
        fn quintics_are_shifted_exactly(d in -6.0f64..6.0) {
            let signal: Vec<f64> = (0..30).map(|n| quintic(f64::from(n) * 0.2).0).collect();
            let shifted = shift(&signal, d).unwrap();
            let slope = shift_derivative(&signal, d).unwrap();
            for n in shifted.valid.clone() {
                let (value, rate) = quintic((n as f64 + d) * 0.2);
                prop_assert!((shifted.values[n] - value).abs() < 1e-11);
                prop_assert!((slope.values[n] - 0.2 * rate).abs() < 1e-11);
            }
            prop_assert!(shifted.valid.len() >= 19);
        }
    }

    #[test]
    fn whole_shifts_move_samples() {
        let signal: Vec<f64> = (0..12).map(|n| f64::from(n * n)).collect();
        let later = shift(&signal, 3.0).unwrap();
        assert_eq!(later.values[..9], signal[3..]);
        assert_eq!(later.values[9..], [121.0; 3]);
        assert_eq!(later.valid, 0..6);
        assert_eq!(shift(&signal, -4.0).unwrap().valid, 6..12);
    }

    #[test]
    fn absurd_shifts_have_no_valid_sample() {
        for d in [1e300, -1e300, 100.5] {
            let shifted = shift(&[1.0, 2.0, 3.0], d).unwrap();
            assert!(shifted.valid.is_empty());
            let end = if d > 0.0 { 3.0 } else { 1.0 };
            assert!(shifted.values.iter().all(|x| (x - end).abs() < 1e-12));
        }
        assert!(shift(&[1.0], f64::NAN).is_err());
        assert!(shift(&[], 0.0).is_err());
    }
}
