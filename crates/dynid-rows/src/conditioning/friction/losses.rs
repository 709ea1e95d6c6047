//! Held-out losses of a joint and when one is better than another.

use crate::conditioning::choose::{error, mean};

/// By how much the logarithm of the loss off reversal may rise for a gain at reversals, where one standard error is less.
const WORSE: f64 = 0.05;

/// Which rows a fit must be better in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum RowsOf {
    /// Off reversal, and no worse in all rows: where they span reversals a shape that was seen in its tail alone shows.
    Motion,
    /// Off reversal, whatever all rows say.
    MotionAlone,
    /// All rows, and no worse off reversal.
    Reversals,
}

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

    /// Whether the other fit is better by `sigmas` standard errors and `share` in the rows that count.
    pub(super) fn falls(&self, to: &Losses, (sigmas, share): (f64, f64), rows: RowsOf) -> bool {
        let [off_reversal, anywhere] = self.gains(to);
        let (gains, no_worse) = match rows {
            RowsOf::Motion => (&off_reversal, mean(&anywhere) > 0.0),
            RowsOf::MotionAlone => (&off_reversal, true),
            RowsOf::Reversals => (&anywhere, mean(&off_reversal) > -error(&off_reversal).max(WORSE)),
        };
        let gain = mean(gains);
        gain > sigmas * error(gains) && gain > -(1.0 - share).ln() && no_worse
    }

    /// By which share the loss in the rows that count falls to another fit, and the standard error of that.
    pub(super) fn share_of_fall(&self, to: &Losses, rows: RowsOf) -> (f64, f64) {
        let [off_reversal, anywhere] = self.gains(to);
        let gains = if rows == RowsOf::Reversals { anywhere } else { off_reversal };
        let left = (-mean(&gains)).exp();
        (1.0 - left, left * error(&gains))
    }
}
