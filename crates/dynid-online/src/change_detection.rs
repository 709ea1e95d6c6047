//! Alarms: whether innovations have become larger than they should be.

use crate::correlation::InnovationCorrelation;
use crate::settings::{DetectionSettings, FalseAlarms, Whiteness};
use crate::thresholds::{cusum_threshold, run_length_for_rate};
use dynid_words::Transfer;

/// Thresholds are not lowered below this, however long the correlation time.
const LEAST_THRESHOLD: f64 = 2.0;

/// Cumulative sum over whitened innovations, `g ← max(0, g + ½ [(1 - 1/κ) Σ min(u², clip) - m ln κ])`, alarm
/// at `g ≥ h`.
///
/// It is the log-likelihood ratio of innovations with variance `κ` against variance 1. Of coloured innovations
/// every sample counts as one part of an independent one, `1/T` with the correlation time `T`; the threshold
/// then falls by the logarithm of that time, since the mean run length of the sum grows as `exp(h)`.
/// Thinning to one sample in `T` would hold the same information, but tell of it up to `T` samples later.
///
/// Sources: Page 1954; Brook & Evans 1972 (threshold).
#[derive(Debug, Clone)]
pub struct ChangeDetection {
    kappa: f64,
    clip: f64,
    threshold: f64,
    every: usize,
    correlation: Option<InnovationCorrelation>,
    statistic: f64,
}

impl ChangeDetection {
    /// Detector for samples of `rows` rows. Allocates and, unless the threshold is given, solves for it (some
    /// milliseconds). Settings must be valid ([`crate::Settings::validate`]).
    pub fn new(settings: &DetectionSettings, rows: usize) -> Self {
        let run_length = match settings.false_alarms {
            FalseAlarms::Rate { rate, samples } => Some(run_length_for_rate(rate, samples)),
            FalseAlarms::RunLength(samples) => Some(samples),
            FalseAlarms::Threshold(_) => None,
        };
        let threshold = match settings.false_alarms {
            FalseAlarms::Threshold(h) => h,
            _ => cusum_threshold(rows, settings.kappa, run_length.unwrap_or(1.0)),
        };
        let (every, correlation) = match settings.whiteness {
            Whiteness::White => (1, None),
            Whiteness::Every(samples) => (samples, None),
            Whiteness::Learned { samples } => (1, Some(InnovationCorrelation::new(rows, samples))),
        };
        let (kappa, clip) = (settings.kappa, settings.clip);
        Self { kappa, clip, threshold, every, correlation, statistic: 0.0 }
    }

    /// Takes the whitened innovations of a sample; true on an alarm, after which the sum starts again from
    /// zero.
    pub fn push(&mut self, whitened: &[f64]) -> bool {
        if self.correlation.as_ref().is_none_or(InnovationCorrelation::is_known) {
            let size = |row: usize| self.correlation.as_ref().map_or(1.0, |c| c.variance(row));
            let sum: f64 = whitened.iter().enumerate().map(|(r, u)| (u * u / size(r)).min(self.clip)).sum();
            let expected = whitened.len() as f64 * libm::log(self.kappa);
            let ratio = 0.5 * ((1.0 - 1.0 / self.kappa) * sum - expected);
            self.statistic = (self.statistic + ratio / self.every() as f64).max(0.0);
        }
        if let Some(correlation) = &mut self.correlation {
            correlation.push(whitened);
        }
        let alarm = self.statistic >= self.threshold();
        if alarm {
            self.restart();
        }
        alarm
    }

    /// The sum starts again from zero; what was learned stays.
    pub fn restart(&mut self) {
        self.statistic = 0.0;
    }

    /// The sum `g`.
    pub fn statistic(&self) -> f64 {
        self.statistic
    }

    /// The threshold `h` in force.
    pub fn threshold(&self) -> f64 {
        (self.threshold - libm::log(self.every() as f64)).max(self.threshold.min(LEAST_THRESHOLD))
    }

    /// Samples that count as one independent sample.
    pub fn every(&self) -> usize {
        self.correlation.as_ref().map_or(self.every, |c| c.time())
    }

    /// By how much gains in the residual sum of squares are overstated, at least 1: learned size and colour
    /// of the innovations, or the samples that count as one.
    pub fn inflation(&self) -> f64 {
        self.correlation.as_ref().map_or(self.every as f64, |c| c.inflation() * c.mean_variance()).max(1.0)
    }

    /// What was learned of the innovations, if that was asked for.
    pub fn correlation(&self) -> Option<&InnovationCorrelation> {
        self.correlation.as_ref()
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.finite(&mut self.statistic);
        if let Some(correlation) = &mut self.correlation {
            correlation.transfer(transfer);
        }
    }
}
