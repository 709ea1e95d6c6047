//! Chebyshev low-pass of the first kind.

use std::f64::consts::PI;

use super::butterworth::check_order;
use super::prototype::{Pole, bilinear};
use super::sections::Sections;
use crate::signal::{SignalError, check_cutoff, check_positive};

/// Digital Chebyshev type I low-pass of even `order` with `ripple_db` in the pass band, which ends at `cutoff_hz`.
///
/// The sections equal those of SciPy's `cheby1(order, ripple_db, cutoff_hz, fs=rate_hz, output='sos')`. Fails unless
/// the order is even, 2 to 20, the ripple positive and `0 < cutoff_hz < rate_hz / 2`.
pub fn chebyshev(
    order: usize,
    ripple_db: f64,
    cutoff_hz: f64,
    rate_hz: f64,
) -> Result<Sections, SignalError> {
    check_order(order)?;
    check_positive("ripple_db", ripple_db)?;
    check_cutoff(cutoff_hz, rate_hz)?;
    let squared_ripple = 10f64.powf(0.1 * ripple_db) - 1.0;
    let mu = (1.0 / squared_ripple.sqrt()).asinh() / order as f64;
    let mut gain = 1.0 / (1.0 + squared_ripple).sqrt();
    let poles: Vec<Pole> = (1..order)
        .step_by(2)
        .map(|m| {
            let angle = PI * m as f64 / (2 * order) as f64;
            let pole = Pole { re: -mu.sinh() * angle.cos(), im: mu.cosh() * angle.sin() };
            gain *= pole.re * pole.re + pole.im * pole.im;
            pole
        })
        .collect();
    Ok(bilinear(&poles, gain, cutoff_hz, rate_hz))
}
