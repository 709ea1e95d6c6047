//! Whether a measured velocity is worth more than the derivative of the position.

use std::f64::consts::PI;

use crate::difference::central;
use crate::filter::{butterworth, forward_backward};
use crate::signal::{SignalError, check_positive};
use crate::spectrum::{NoiseSettings, effort_noise, position_noise};

/// A measured velocity against the derivative of the position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityComparison {
    /// Measured over derived velocity; 1 if the units agree. `None` if the joint does not move.
    pub scale: Option<f64>,
    /// Time by which the measured velocity lags behind the position, s. `None` if the joint does not move.
    pub delay: Option<f64>,
    /// Root mean square of what scale and delay leave, over that of the derived velocity.
    pub mismatch: f64,
    /// White noise of the measured velocity, (rad/s)^2/Hz.
    pub measured_psd: f64,
    /// Mean noise density below `cutoff_hz` of the derivative of the position, `S_n (2 pi fe)^2 / 3`, (rad/s)^2/Hz.
    pub derived_psd: f64,
}

impl VelocityComparison {
    /// Whether the measured velocity is the less noisy one.
    pub fn measured_is_better(&self) -> bool {
        self.measured_psd < self.derived_psd
    }
}

/// Compares by regressing the measured velocity on the derived one and its derivative (`-scale * delay` is the
/// coefficient of the latter), all below `cutoff_hz` (zero-phase Butterworth of order 4, one period cut at either end),
/// and the noise densities below `cutoff_hz`.
///
/// Two passes: the first delay shifts the derived velocity before the second, so that a delay of some samples is exact.
/// Fails if the lengths differ, the cut-off is not below half the rate or the record is shorter than three periods of it.
pub fn compare(
    position: &[f64],
    measured: &[f64],
    rate_hz: f64,
    cutoff_hz: f64,
) -> Result<VelocityComparison, SignalError> {
    check_positive("rate_hz", rate_hz)?;
    if measured.len() != position.len() {
        return Err(SignalError::Length {
            what: "measured velocity",
            expected: position.len(),
            found: measured.len(),
        });
    }
    let filter = butterworth(4, cutoff_hz, rate_hz)?;
    let edge = (rate_hz / cutoff_hz).ceil() as usize;
    let expected = 3 * edge.max(8);
    if position.len() < expected {
        return Err(SignalError::TooShort { expected, found: position.len() });
    }
    let settings = NoiseSettings::default();
    let floor = position_noise(position, rate_hz, &settings)?;
    let derived = central(&forward_backward(&filter, position)?, rate_hz)?;
    let smooth = forward_backward(&filter, measured)?;
    let inside = edge..position.len() - edge;
    let mut delay = 0.0;
    let mut fit = None;
    if floor.crossing_hz.is_some() {
        for _ in 0..2 {
            let shifted = crate::shift::shift(&derived, -delay * rate_hz)?;
            let slope = central(&shifted.values, rate_hz)?;
            fit = regress(&shifted.values[inside.clone()], &slope[inside.clone()], &smooth[inside.clone()]);
            match fit {
                Some((scale, lag)) if scale != 0.0 => delay -= lag / scale,
                _ => break,
            }
        }
    }
    let (scale, delay) = match fit {
        Some((scale, _)) if scale != 0.0 && delay.is_finite() => (Some(scale), Some(delay)),
        _ => (None, None),
    };
    let mismatch = mismatch(&derived, &smooth, inside, rate_hz, scale.unwrap_or(0.0), delay.unwrap_or(0.0))?;
    Ok(VelocityComparison {
        scale,
        delay,
        mismatch,
        measured_psd: effort_noise(measured, rate_hz, &settings)?.floor_psd,
        derived_psd: floor.floor_psd * (2.0 * PI * cutoff_hz).powi(2) / 3.0,
    })
}

fn regress(value: &[f64], slope: &[f64], target: &[f64]) -> Option<(f64, f64)> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>();
    let (vv, vs, ss) = (dot(value, value), dot(value, slope), dot(slope, slope));
    let (vt, st) = (dot(value, target), dot(slope, target));
    let determinant = vv * ss - vs * vs;
    // Value and derivative of a motion are nearly orthogonal; a determinant at rounding level means no motion.
    if determinant <= 1e-12 * vv * ss {
        return None;
    }
    Some(((vt * ss - st * vs) / determinant, (st * vv - vt * vs) / determinant))
}

fn mismatch(
    derived: &[f64],
    measured: &[f64],
    inside: std::ops::Range<usize>,
    rate_hz: f64,
    scale: f64,
    delay: f64,
) -> Result<f64, SignalError> {
    let shifted = crate::shift::shift(derived, -delay * rate_hz)?.values;
    let left: f64 = inside.clone().map(|n| (measured[n] - scale * shifted[n]).powi(2)).sum();
    let size: f64 = inside.map(|n| derived[n].powi(2)).sum();
    Ok(if size > 0.0 { (left / size).sqrt() } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_and_delay_are_recovered() {
        let rate = 500.0;
        let (w, delay) = (4.0, 0.0073);
        let t = |n: u32| f64::from(n) / rate;
        let position: Vec<f64> = (0..5000)
            .map(|n| ((w * t(n)).sin() + 0.3 * (2.3 * w * t(n)).cos()) / 1e-5)
            .map(|x| x.round() * 1e-5)
            .collect();
        let measured: Vec<f64> = (0..5000)
            .map(|n| t(n) - delay)
            .map(|t| 1.1 * w * ((w * t).cos() - 0.69 * (2.3 * w * t).sin()))
            .collect();
        let found = compare(&position, &measured, rate, 10.0).unwrap();
        // Central differences and filter droop change the derived velocity by some 1e-4 at 1.5 Hz.
        assert!((found.scale.unwrap() - 1.1).abs() < 5e-4, "{found:?}");
        assert!((found.delay.unwrap() - delay).abs() < 2e-5, "{found:?}");
        assert!(found.mismatch < 2e-3, "{found:?}");
        assert!(found.measured_is_better());
    }

    #[test]
    fn a_joint_at_rest_has_no_scale() {
        let found = compare(&[0.4; 500], &[0.0; 500], 100.0, 10.0).unwrap();
        assert_eq!((found.scale, found.delay), (None, None));
        assert!(found.mismatch.is_finite());
        assert!(compare(&[0.4; 500], &[0.0; 400], 100.0, 10.0).is_err());
        assert!(compare(&[0.4; 20], &[0.0; 20], 100.0, 10.0).is_err());
    }
}
