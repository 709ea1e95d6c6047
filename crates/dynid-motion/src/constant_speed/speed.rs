//! Speed of a joint from its positions.

use super::ConstantSpeedError;
use crate::log::JointSignals;
use crate::median::median;
use crate::signal::{SignalError, check_finite, check_positive, quantum};

/// Speed around every sample, and how far noise moves it.
pub(super) struct Smoothed {
    pub(super) speed: Vec<f64>,
    /// Standard deviation of noise in `speed`.
    pub(super) noise: f64,
}

/// Speed of a joint at every sample, rad/s or m/s: the slope of the least-squares line through its positions within
/// `window` seconds, or the mean of its logged velocity there.
///
/// # Errors
/// Fails as [`segments()`](super::segments()) does.
pub fn speed(
    time: &[f64],
    joint: &JointSignals,
    window: f64,
    use_velocity: bool,
) -> Result<Vec<f64>, ConstantSpeedError> {
    check_positive("window", window)?;
    check(time, &[("position", &joint.position)])?;
    match &joint.velocity {
        Some(velocity) if use_velocity => {
            check(time, &[("velocity", velocity)])?;
            Ok(of_velocity(time, velocity, window).speed)
        }
        _ => Ok(of_positions(time, &joint.position, window).speed),
    }
}

pub(super) fn check(time: &[f64], signals: &[(&'static str, &[f64])]) -> Result<(), ConstantSpeedError> {
    if time.len() < 3 {
        return Err(SignalError::TooShort { expected: 3, found: time.len() }.into());
    }
    check_finite(time)?;
    for (what, signal) in signals {
        if signal.len() != time.len() {
            let (expected, found) = (time.len(), signal.len());
            return Err(SignalError::Length { what, expected, found }.into());
        }
        check_finite(signal)?;
    }
    match time.windows(2).position(|t| t[1] <= t[0]) {
        None => Ok(()),
        Some(k) => Err(ConstantSpeedError::Time { sample: k + 1, before: time[k], found: time[k + 1] }),
    }
}

/// Slope of the least-squares line through the positions within `window` seconds around every sample.
///
/// Noise: white noise of the positions (from second differences, at least that of rounding to the quantum) through the
/// same line; rounding of a slow motion is no white noise, so that a quantum per window counts too.
pub(super) fn of_positions(time: &[f64], position: &[f64], window: f64) -> Smoothed {
    let step = quantum(position);
    let bend: Vec<f64> = position.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
    let white = (0.605 * median(&bend).unwrap_or(0.0)).max(step / 12f64.sqrt());
    let mut counts = Vec::with_capacity(time.len());
    let speed = windows(time, window)
        .enumerate()
        .map(|(n, rows)| {
            counts.push(rows.len());
            slope(&time[rows.clone()], &position[rows], time[n], position[n])
        })
        .collect();
    counts.sort_unstable();
    let samples = counts[counts.len() / 2].max(2) as f64;
    let span = window.max(median_step(time) * 2.0);
    let noise = white * (12.0 / samples).sqrt() / span + 0.3 * step / span;
    Smoothed { speed, noise }
}

/// Mean of the measured velocity within `window` seconds around every sample.
pub(super) fn of_velocity(time: &[f64], velocity: &[f64], window: f64) -> Smoothed {
    let mut sums = Vec::with_capacity(velocity.len() + 1);
    sums.push(0.0);
    for v in velocity {
        sums.push(sums[sums.len() - 1] + v);
    }
    let mut samples = 0;
    let speed = windows(time, window)
        .map(|rows| {
            samples = samples.max(rows.len());
            (sums[rows.end] - sums[rows.start]) / rows.len() as f64
        })
        .collect();
    let change: Vec<f64> = velocity.windows(2).map(|w| (w[1] - w[0]).abs()).collect();
    let white = 1.4826 / 2f64.sqrt() * median(&change).unwrap_or(0.0);
    Smoothed { speed, noise: white / (samples.max(1) as f64).sqrt() }
}

pub(super) fn median_step(time: &[f64]) -> f64 {
    let steps: Vec<f64> = time.windows(2).map(|t| t[1] - t[0]).collect();
    median(&steps).unwrap_or(0.0)
}

/// Slope of the least-squares line; `t0`, `x0` only keep the sums small.
pub(super) fn slope(time: &[f64], position: &[f64], t0: f64, x0: f64) -> f64 {
    let n = time.len() as f64;
    let (mut st, mut sx, mut stt, mut stx) = (0.0, 0.0, 0.0, 0.0);
    for (t, x) in time.iter().zip(position) {
        let (t, x) = (t - t0, x - x0);
        st += t;
        sx += x;
        stt += t * t;
        stx += t * x;
    }
    let spread = stt - st * st / n;
    if spread > 0.0 { (stx - st * sx / n) / spread } else { 0.0 }
}

/// Rows within half a window of every sample, at least its neighbours.
fn windows(time: &[f64], window: f64) -> impl Iterator<Item = std::ops::Range<usize>> + '_ {
    let (mut start, mut end) = (0, 0);
    let n = time.len();
    (0..n).map(move |k| {
        while time[k] - time[start] > 0.5 * window {
            start += 1;
        }
        while end < n && time[end] - time[k] <= 0.5 * window {
            end += 1;
        }
        start.min(k.saturating_sub(1))..end.max((k + 2).min(n))
    })
}
