//! How the textbook route brings positions to states, and smooths efforts alike.

use std::f64::consts::TAU;

use dynid_motion::SignalError;
use dynid_motion::difference::central;
use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::harmonics::Harmonics;
use dynid_motion::savitzky_golay::SavitzkyGolay;
use dynid_motion::signal::check_signal;
use dynid_motion::smoothing::{five_point_cubic, five_point_half_amplitude};
use rayon::prelude::*;

use super::{ConditioningError, PeriodicMotion, PreparedLog, Smoothing};

/// States of all outputs of a log.
#[derive(Debug)]
pub(super) struct SmoothMotion {
    /// Positions.
    pub q: Vec<Vec<f64>>,
    /// Velocities and accelerations where they are not central differences of the positions.
    pub rates: Option<[Vec<Vec<f64>>; 2]>,
    /// Standard deviation of the velocity that comes from position noise.
    pub velocity_sigma: Vec<f64>,
}

impl Smoothing {
    /// Cut-off, Hz: of the Butterworth and of the series that of the settings, `given`, unless harmonics are; of polynomials the
    /// frequency at which the amplitude falls to one half, as that of the Butterworth forward and backward does at its cut-off.
    pub fn cutoff_hz(&self, given: f64, log: &PreparedLog) -> f64 {
        let half = |part: Option<f64>| part.unwrap_or(0.5) * log.rate_hz;
        match self {
            Smoothing::Butterworth => given,
            Smoothing::FivePoint { passes } => half(five_point_half_amplitude(*passes)),
            Smoothing::SavitzkyGolay(filter) => half(filter.half_amplitude()),
            Smoothing::Frequency { harmonics } => match (harmonics, &log.periodic) {
                (Some(last), Some(motion)) => *last as f64 / motion.period_s,
                _ => given,
            },
        }
    }

    /// States of a log; `None` where those of [`super::States`] without a smoothing of its own stand: Butterworth, or no period.
    pub(super) fn motion(
        &self,
        log: &PreparedLog,
        cutoff_hz: f64,
    ) -> Result<Option<SmoothMotion>, ConditioningError> {
        let rate = log.rate_hz;
        let sigma = |gain: f64| log.position_noise.iter().map(|noise| gain * noise.sigma).collect();
        match self {
            Smoothing::Butterworth => Ok(None),
            Smoothing::FivePoint { passes } => {
                let q = smooth_all(&log.position, |q| five_point_cubic(q, *passes))?;
                let velocity_sigma = sigma(five_point_velocity_gain(*passes, rate)?);
                Ok(Some(SmoothMotion { q, rates: None, velocity_sigma }))
            }
            Smoothing::SavitzkyGolay(filter) => Ok(Some(polynomials(filter, log)?)),
            Smoothing::Frequency { harmonics } => {
                let Some(motion) = &log.periodic else { return Ok(None) };
                let last = last_harmonic(*harmonics, motion, cutoff_hz, rate)?;
                let series: Vec<Harmonics> = log
                    .position
                    .par_iter()
                    .map(|q| series(log, motion, q, last))
                    .collect::<Result<_, SignalError>>()?;
                let samples = log.samples();
                let rates: Vec<Harmonics> = series.iter().map(|s| s.derivative(rate)).collect();
                let values = |s: &[Harmonics]| s.iter().map(|s| s.values(samples)).collect::<Vec<_>>();
                let accelerations: Vec<Harmonics> = rates.iter().map(|s| s.derivative(rate)).collect();
                // White noise leaves the mean power 4 σ²/N in a harmonic.
                let usable = log.usable.iter().filter(|u| **u).count().max(1) as f64;
                let squares: f64 = (1..=last).map(|k| (TAU * k as f64 / motion.period_s).powi(2)).sum();
                Ok(Some(SmoothMotion {
                    q: values(&series),
                    rates: Some([values(&rates), values(&accelerations)]),
                    velocity_sigma: sigma((2.0 * squares / usable).sqrt()),
                }))
            }
        }
    }

    /// States of another motion on a grid of the same rate; `None` where the Butterworth stands for the smoothing.
    pub(super) fn along(
        &self,
        position: &[Vec<f64>],
        rate_hz: f64,
    ) -> Result<Option<SmoothMotion>, ConditioningError> {
        let velocity_sigma = vec![0.0; position.len()];
        match self {
            Smoothing::Butterworth | Smoothing::Frequency { .. } => Ok(None),
            Smoothing::FivePoint { passes } => {
                let q = smooth_all(position, |q| five_point_cubic(q, *passes))?;
                Ok(Some(SmoothMotion { q, rates: None, velocity_sigma }))
            }
            Smoothing::SavitzkyGolay(filter) => {
                let [q, dq, ddq] = derivatives(filter, position, rate_hz)?;
                Ok(Some(SmoothMotion { q, rates: Some([dq, ddq]), velocity_sigma }))
            }
        }
    }

    /// An effort of a log through the same smoothing as positions. `order`: of the Butterworth.
    pub(super) fn effort(
        &self,
        log: &PreparedLog,
        effort: &[f64],
        cutoff_hz: f64,
        order: usize,
    ) -> Result<Vec<f64>, ConditioningError> {
        Ok(match self {
            Smoothing::Butterworth => forward_backward(&butterworth(order, cutoff_hz, log.rate_hz)?, effort)?,
            Smoothing::FivePoint { passes } => five_point_cubic(effort, *passes)?,
            Smoothing::SavitzkyGolay(filter) => filter.filter(effort, 0, log.rate_hz)?,
            Smoothing::Frequency { harmonics } => {
                let motion = self.period_of(log)?;
                let last = last_harmonic(*harmonics, motion, cutoff_hz, log.rate_hz)?;
                series(log, motion, effort, last)?.values(log.samples())
            }
        })
    }

    /// The period of a log that rows are to be made of by Fourier series.
    fn period_of<'a>(&self, log: &'a PreparedLog) -> Result<&'a PeriodicMotion, ConditioningError> {
        log.periodic.as_ref().ok_or_else(|| ConditioningError::NoPeriod { log: log.name.clone() })
    }

    /// Refuses a log without the period that the smoothing needs.
    pub(super) fn check(&self, log: &PreparedLog) -> Result<(), ConditioningError> {
        match self {
            Smoothing::Frequency { .. } => self.period_of(log).map(drop),
            _ => Ok(()),
        }
    }
}

fn smooth_all(
    signals: &[Vec<f64>],
    smooth: impl Fn(&[f64]) -> Result<Vec<f64>, SignalError> + Sync,
) -> Result<Vec<Vec<f64>>, SignalError> {
    signals.par_iter().map(|signal| smooth(signal)).collect()
}

/// Standard deviation of the velocity from white noise of standard deviation 1 through five-point smoothing and central differences.
fn five_point_velocity_gain(passes: usize, rate_hz: f64) -> Result<f64, SignalError> {
    // Wide enough for an impulse in the middle to leave the ends at zero.
    let half = 2 * passes + 3;
    let mut impulse = vec![0.0; 2 * half + 1];
    impulse[half] = 1.0;
    let velocity = central(&five_point_cubic(&impulse, passes)?, rate_hz)?;
    Ok(velocity.iter().map(|v| v * v).sum::<f64>().sqrt())
}

/// Values and two derivatives of all signals.
fn derivatives(
    filter: &SavitzkyGolay,
    position: &[Vec<f64>],
    rate_hz: f64,
) -> Result<[Vec<Vec<f64>>; 3], SignalError> {
    let of = |derivative: usize| smooth_all(position, |q| filter.filter(q, derivative, rate_hz));
    Ok([of(0)?, of(1)?, of(2)?])
}

fn polynomials(filter: &SavitzkyGolay, log: &PreparedLog) -> Result<SmoothMotion, SignalError> {
    let [q, dq, ddq] = derivatives(filter, &log.position, log.rate_hz)?;
    let weights = filter.weights(filter.window() / 2, 1);
    let gain = log.rate_hz * weights.iter().map(|w| w * w).sum::<f64>().sqrt();
    let velocity_sigma = log.position_noise.iter().map(|noise| gain * noise.sigma).collect();
    Ok(SmoothMotion { q, rates: Some([dq, ddq]), velocity_sigma })
}

/// The last harmonic at or below a cut-off, or the one that is given.
fn last_harmonic(
    given: Option<usize>,
    motion: &PeriodicMotion,
    cutoff_hz: f64,
    rate_hz: f64,
) -> Result<usize, SignalError> {
    // A cut-off that is a whole number of harmonics includes the last of them whatever the rounding of the period.
    let last = given.unwrap_or((cutoff_hz * motion.period_s * (1.0 + 1e-9)) as usize);
    if last == 0 {
        let expected = "1 or more: a cut-off of at least one over the period";
        return Err(SignalError::Setting { name: "harmonics", expected, found: 0.0 });
    }
    if last as f64 >= 0.5 * motion.period_s * rate_hz {
        let expected = "less than half the samples of a period";
        return Err(SignalError::Setting { name: "harmonics", expected, found: last as f64 });
    }
    Ok(last)
}

fn series(
    log: &PreparedLog,
    motion: &PeriodicMotion,
    signal: &[f64],
    last: usize,
) -> Result<Harmonics, SignalError> {
    check_signal(signal, 2 * last + 2)?;
    Ok(Harmonics::fit(signal, &log.usable, TAU / (motion.period_s * log.rate_hz), last))
}
