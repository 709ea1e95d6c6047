//! Butterworth low-pass.

use std::f64::consts::PI;

use super::prototype::{Pole, bilinear};
use super::sections::Sections;
use crate::signal::{SignalError, check_cutoff};

/// Digital Butterworth low-pass of even `order` with -3 dB at `cutoff_hz` (bilinear transformation, prewarped).
///
/// The sections equal those of SciPy's `butter(order, cutoff_hz, fs=rate_hz, output='sos')`. Fails unless the order
/// is even, 2 to 20, and `0 < cutoff_hz < rate_hz / 2`.
pub fn butterworth(order: usize, cutoff_hz: f64, rate_hz: f64) -> Result<Sections, SignalError> {
    check_order(order)?;
    check_cutoff(cutoff_hz, rate_hz)?;
    let poles: Vec<Pole> = (1..order)
        .step_by(2)
        .map(|m| {
            let angle = PI * m as f64 / (2 * order) as f64;
            Pole { re: -angle.cos(), im: angle.sin() }
        })
        .collect();
    Ok(bilinear(&poles, 1.0, cutoff_hz, rate_hz))
}

pub(super) fn check_order(order: usize) -> Result<(), SignalError> {
    if order.is_multiple_of(2) && (2..=20).contains(&order) {
        return Ok(());
    }
    Err(SignalError::Setting { name: "order", expected: "an even number from 2 to 20", found: order as f64 })
}
