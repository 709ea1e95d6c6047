//! Faults of a record that it shows by itself: rows that repeat, rows that logs share, signals that freeze, efforts that are cut off.
//!
//! Every test asks what a sound record would hardly show, given how often its values repeat anyway: encoders at rest and
//! coarse currents repeat for long and are no fault.

mod clipped;
mod frozen;
mod outliers;
mod repeated;
mod shared;

pub use clipped::{Clipping, clipped};
pub use frozen::{frozen_effort, frozen_position};
pub use outliers::outliers;
pub use repeated::{Repeats, repeated};
pub use shared::{SharedRows, shared_rows};

/// A run of samples, counted from 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Run {
    /// First sample.
    pub first: usize,
    /// Number of samples.
    pub length: usize,
}

/// Chance below which a run of equal values is no accident.
const CHANCE: f64 = 1e-6;

/// Runs of at least `least` equal values.
fn runs(signal: &[f64], least: usize) -> Vec<Run> {
    let mut out = Vec::new();
    let mut first = 0;
    for k in 1..=signal.len() {
        if k == signal.len() || signal[k] != signal[first] {
            if k - first >= least {
                out.push(Run { first, length: k - first });
            }
            first = k;
        }
    }
    out
}

/// Whether a run of equal values is no accident where a share `repeats` of all values equals the one before.
fn is_no_accident(length: usize, repeats: f64, samples: usize) -> bool {
    let log_chance = (length as f64 - 1.0) * repeats.max(1e-3).ln() + (samples as f64).ln();
    log_chance < CHANCE.ln()
}

/// What 99 % of the values stay below; 0 of none.
fn high_quantile(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let place = (values.len() - 1) * 99 / 100;
    *values.select_nth_unstable_by(place, f64::total_cmp).1
}
