//! Signals of deformations: through one filter, away from edges and gaps, no more of them than it leaves different.

use dynid_motion::SignalError;
use dynid_motion::difference::central;
use dynid_motion::filter::{Sections, butterworth, forward_backward};
use dynid_motion::mask::{self, dilate};
use dynid_rows::conditioning::PreparedLog;

/// Cut-off of all signals, Hz.
const CUTOFF_HZ: f64 = 10.0;
/// Rows kept per period of the cut-off.
const PER_PERIOD: f64 = 5.0;

/// Cut-off of the filter at a sample rate, Hz.
fn cutoff(rate_hz: f64) -> f64 {
    CUTOFF_HZ.min(0.1 * rate_hz)
}

/// Rows per second that are kept of a log.
pub(super) fn rows_hz(rate_hz: f64) -> f64 {
    PER_PERIOD * cutoff(rate_hz)
}

/// The filter of a log, and the samples that are kept.
pub(crate) struct Sieve {
    filter: Sections,
    rate_hz: f64,
    pub(crate) kept: Vec<usize>,
}

/// A position through the filter, with its derivatives, whole.
pub(crate) struct Smooth {
    pub(crate) position: Vec<f64>,
    pub(crate) speed: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
}

/// Deformation of a joint at the samples that are kept, and what goes with it.
pub(crate) struct Deformed {
    /// Motor, on the side of the joint, less link, rad (m).
    pub(crate) deformation: Vec<f64>,
    /// Speed of the link.
    pub(crate) speed: Vec<f64>,
    /// Sign of the speed of the motor, through the filter.
    pub(crate) towards: Vec<f64>,
    /// Position of the link.
    pub(crate) position: Vec<f64>,
}

impl Sieve {
    pub(crate) fn new(log: &PreparedLog) -> Result<Self, SignalError> {
        let (rate_hz, n) = (log.rate_hz, log.samples());
        let cutoff = cutoff(rate_hz);
        let margin = (2.0 * rate_hz / cutoff).ceil() as usize;
        let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
        bad = dilate(&bad, margin);
        mask::merge(&mut bad, &mask::edges(n, margin));
        let thin = ((rate_hz / rows_hz(rate_hz)) as usize).max(1);
        let kept = (0..n).step_by(thin).filter(|k| !bad[*k]).collect();
        Ok(Sieve { filter: butterworth(4, cutoff, rate_hz)?, rate_hz, kept })
    }

    pub(crate) fn pick(&self, signal: &[f64]) -> Vec<f64> {
        self.kept.iter().map(|k| signal[*k]).collect()
    }

    /// A signal through the filter, at the samples that are kept.
    pub(crate) fn filtered(&self, signal: &[f64]) -> Result<Vec<f64>, SignalError> {
        Ok(self.pick(&forward_backward(&self.filter, signal)?))
    }

    pub(crate) fn smooth(&self, position: &[f64]) -> Result<Smooth, SignalError> {
        let position = forward_backward(&self.filter, position)?;
        let speed = central(&position, self.rate_hz)?;
        let acceleration = central(&speed, self.rate_hz)?;
        Ok(Smooth { position, speed, acceleration })
    }

    /// What a joint deforms by. `motor`: its positions as they are and smooth, `ratio` times those of a stiff joint; `link`: the same of the link.
    pub(crate) fn deformed(
        &self,
        (motor, moves, ratio): (&[f64], &Smooth, f64),
        (link, follows): (&[f64], &Smooth),
    ) -> Result<Deformed, SignalError> {
        let raw: Vec<f64> = motor.iter().zip(link).map(|(motor, link)| motor / ratio - link).collect();
        let towards: Vec<f64> = moves.speed.iter().map(|v| (v / ratio).signum()).collect();
        Ok(Deformed {
            deformation: self.filtered(&raw)?,
            speed: self.pick(&follows.speed),
            towards: self.filtered(&towards)?,
            position: self.pick(&follows.position),
        })
    }
}
