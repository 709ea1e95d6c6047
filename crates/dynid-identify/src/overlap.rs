//! Rows that logs share although every log should be a recording of its own.

use dynid_motion::faults::shared_rows;
use serde::{Deserialize, Serialize};

use crate::log::Log;

/// From this share on a log repeats another one ...
pub(crate) const REPEATS: f64 = 0.05;
/// ... and below this one nothing is said.
const SOME: f64 = 0.01;

/// Rows of a log that another one holds too.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Overlap {
    /// Log.
    pub log: String,
    /// The training log that holds the same rows.
    pub with: String,
    /// Share of the rows in motion of the shorter of the two, 0 to 1.
    pub share: f64,
    /// Number of the log among training and validation logs, in this order.
    #[serde(skip)]
    pub(crate) number: usize,
}

impl Overlap {
    /// Whether so much is shared that the log is no recording of its own.
    pub fn repeats(&self) -> bool {
        self.share >= REPEATS
    }

    /// What is shared, in words.
    pub(crate) fn words(&self) -> String {
        match self.log == self.with {
            true => format!("`{}` is given more than once", self.log),
            false => {
                let share = 100.0 * self.share;
                format!("`{}` and `{}` share {share:.0} % of their rows in motion", self.log, self.with)
            }
        }
    }
}

/// Rows that logs of a run share.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Overlaps {
    /// Training logs that repeat earlier ones: their rows count more than once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub training: Vec<Overlap>,
    /// Validation logs with rows of training logs: the model has seen them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<Overlap>,
}

impl Overlaps {
    /// Compares all logs of a run.
    pub fn of(training: &[Log], validation: &[Log]) -> Overlaps {
        let logs: Vec<_> = training.iter().chain(validation).map(|l| &l.log).collect();
        let mut out = Overlaps::default();
        for found in shared_rows(&logs) {
            let share = found.share();
            if share < SOME || found.other >= training.len() {
                continue;
            }
            let name = |k: usize| logs[k].name().to_owned();
            let overlap = Overlap { log: name(found.log), with: name(found.other), share, number: found.log };
            match found.log < training.len() {
                true => out.training.push(overlap),
                false => out.validation.push(overlap),
            }
        }
        out
    }

    /// Whether a log, by its number among training and validation logs, repeats a training log.
    pub(crate) fn repeats(&self, number: usize) -> bool {
        self.training.iter().chain(&self.validation).any(|o| o.number == number && o.repeats())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.training.is_empty() && self.validation.is_empty()
    }
}
