//! Derivatives of motions that repeat, by their harmonics.

use std::f64::consts::TAU;

use realfft::num_complex::Complex;
use realfft::{FftError, RealFftPlanner};

use crate::harmonics::Harmonics;
use crate::signal::{SignalError, check_positive, check_signal};

/// How the harmonics of a record were found. Both ways give the same numbers where both apply.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum HarmonicPath {
    /// The record holds whole periods: bins of its discrete Fourier transform.
    Transform,
    /// The samples do not: least squares.
    LeastSquares,
}

/// A motion that repeats, and its derivatives.
#[derive(Debug, Clone, PartialEq)]
pub struct PeriodicStates {
    /// Position: the harmonics alone.
    pub position: Vec<f64>,
    /// Velocity, per s.
    pub velocity: Vec<f64>,
    /// Acceleration, per s².
    pub acceleration: Vec<f64>,
    /// How the harmonics were found.
    pub path: HarmonicPath,
}

/// A record is whole periods if its length is a multiple of the period within this part of a period.
const WHOLE: f64 = 1e-9;

/// Position, velocity and acceleration from the harmonics `0 ..= harmonics` of a motion that repeats every `period_s`:
/// all other frequencies are dropped, and harmonic `k` is multiplied by `j k ω` and `-(k ω)²`, `ω = 2π/period_s`
/// (Swevers et al. 1997).
///
/// A record of whole periods passes a discrete Fourier transform; any other is fitted by least squares
/// ([`Harmonics::fit`]). Without noise and higher harmonics, both give exact derivatives.
///
/// # Errors
/// [`SignalError`] if the record is shorter than a period or has fewer than `2 harmonics + 2` samples, a sample is not
/// finite, rate or period is not positive, or the last harmonic does not lie below half the sample rate.
pub fn differentiate(
    signal: &[f64],
    rate_hz: f64,
    period_s: f64,
    harmonics: usize,
) -> Result<PeriodicStates, SignalError> {
    check_positive("rate_hz", rate_hz)?;
    check_positive("period_s", period_s)?;
    let per_period = rate_hz * period_s;
    check_signal(signal, (2 * harmonics + 2).max((per_period * (1.0 - WHOLE)).ceil() as usize))?;
    if harmonics as f64 >= 0.5 * per_period {
        return Err(SignalError::Setting {
            name: "harmonics",
            expected: "less than half the samples of a period",
            found: harmonics as f64,
        });
    }
    let periods = signal.len() as f64 / per_period;
    if (periods - periods.round()).abs() <= WHOLE {
        return by_transform(signal, rate_hz, periods.round() as usize, harmonics).map_err(|_| {
            // The buffers come from the plan itself, so their lengths fit.
            SignalError::Length { what: "transform", expected: signal.len(), found: signal.len() }
        });
    }
    let series = Harmonics::fit(signal, &vec![true; signal.len()], TAU / per_period, harmonics);
    let velocity = series.derivative(rate_hz);
    Ok(PeriodicStates {
        position: series.values(signal.len()),
        acceleration: velocity.derivative(rate_hz).values(signal.len()),
        velocity: velocity.values(signal.len()),
        path: HarmonicPath::LeastSquares,
    })
}

fn by_transform(
    signal: &[f64],
    rate_hz: f64,
    periods: usize,
    harmonics: usize,
) -> Result<PeriodicStates, FftError> {
    let samples = signal.len();
    let mut planner = RealFftPlanner::<f64>::new();
    let forward = planner.plan_fft_forward(samples);
    let inverse = planner.plan_fft_inverse(samples);
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut signal.to_vec(), &mut spectrum)?;
    let back = |factor: &dyn Fn(f64) -> Complex<f64>| -> Result<Vec<f64>, FftError> {
        let mut kept = inverse.make_input_vec();
        for bin in (0..=harmonics).map(|k| k * periods) {
            let omega = TAU * bin as f64 * rate_hz / samples as f64;
            kept[bin] = spectrum[bin] * factor(omega) / samples as f64;
        }
        let mut out = inverse.make_output_vec();
        inverse.process(&mut kept, &mut out)?;
        Ok(out)
    };
    Ok(PeriodicStates {
        position: back(&|_| Complex::new(1.0, 0.0))?,
        velocity: back(&|omega| Complex::new(0.0, omega))?,
        acceleration: back(&|omega| Complex::new(-omega * omega, 0.0))?,
        path: HarmonicPath::Transform,
    })
}
