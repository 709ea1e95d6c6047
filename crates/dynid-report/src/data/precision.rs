//! What the residuals say about the standard deviations.

use dynid_record::Basis;
use serde::Serialize;

/// Precision of the estimate.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Precision {
    /// By how much coloured residuals inflate the variances that white ones would give.
    pub variance_inflation: Option<f64>,
    /// Variance inflation per joint, where it can be told.
    pub variance_inflation_per_joint: Vec<Option<f64>>,
    /// What the standard deviations rest on.
    pub basis: Basis,
    /// Number of time blocks behind the standard deviations, or of robots.
    pub blocks: Option<u64>,
    /// Length of the time blocks, s.
    pub block_s: Option<f64>,
    /// Length that the correlation of the residuals asks for, s.
    pub wanted_block_s: Option<f64>,
    /// Whether the standard deviations shown hold for coloured residuals.
    pub robust: bool,
    /// Per training log, tests of whiteness.
    pub whiteness: Vec<LogWhiteness>,
}

/// Whiteness of the residuals of one log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LogWhiteness {
    /// Name of the log.
    pub log: String,
    /// Per joint; `None` where there are too few rows to tell.
    pub joints: Vec<Option<Whiteness>>,
}

/// Cumulative periodogram test of one residual.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Whiteness {
    /// Largest distance of the cumulative periodogram from a straight line.
    pub distance: f64,
    /// Threshold of that distance at 5 %.
    pub threshold: f64,
    /// White noise is rejected.
    pub rejected: bool,
    /// Frequency of the largest peak, Hz.
    pub dominant_hz: f64,
}
