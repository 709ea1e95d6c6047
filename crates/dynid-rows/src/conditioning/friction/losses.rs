//! Held-out losses of a joint and when one is better than another.

use crate::conditioning::choose::{error, mean};

/// Logarithms of held-out mean square residuals, per time block.
pub(super) struct Losses {
    /// In rows off reversal.
    pub(super) off_reversal: Vec<f64>,
    /// In all rows.
    pub(super) anywhere: Vec<f64>,
}

impl Losses {
    pub(super) fn mean(&self) -> f64 {
        mean(&self.off_reversal)
    }

    /// Falls of the loss to another fit: in rows off reversal, in all rows.
    fn gains(&self, to: &Losses) -> [Vec<f64>; 2] {
        let gains = |from: &[f64], to: &[f64]| from.iter().zip(to).map(|(a, b)| a - b).collect();
        [gains(&self.off_reversal, &to.off_reversal), gains(&self.anywhere, &to.anywhere)]
    }

    /// Whether the other fit is better by `sigmas` standard errors and `share`, and no worse where rows span reversals:
    /// there a shape that was seen in its tail alone shows.
    pub(super) fn falls(&self, to: &Losses, (sigmas, share): (f64, f64)) -> bool {
        let [gains, anywhere] = self.gains(to);
        let gain = mean(&gains);
        gain > sigmas * error(&gains) && gain > -(1.0 - share).ln() && mean(&anywhere) > 0.0
    }

    /// By which share the loss falls to another fit, and the standard error of that.
    pub(super) fn share_of_fall(&self, to: &Losses) -> (f64, f64) {
        let [gains, _] = self.gains(to);
        let left = (-mean(&gains)).exp();
        (1.0 - left, left * error(&gains))
    }
}
