//! What stands beside the verdict on the first screen.

use serde::Serialize;

/// The log that the result is judged by, and one joint of it drawn.
///
/// Errors per joint are the [`crate::JointQuality::filtered`] ones of that log.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Judged {
    /// Index of the log in [`crate::ReportData::logs`].
    pub log: usize,
    /// The model has not seen the log.
    pub unseen: bool,
    /// Number of further logs of this kind, none of which is predicted worse.
    pub others: usize,
    /// Index of the joint that is drawn.
    pub joint: usize,
    /// Why this joint, e.g. `the joint predicted worst`.
    pub why: String,
    /// Time of each sample drawn, s; finite and not decreasing.
    pub time_s: Vec<f64>,
    /// Measured effort, one entry per time, in the joint's effort unit.
    pub measured: Vec<f64>,
    /// Predicted effort.
    pub predicted: Vec<f64>,
    /// Which effort this is, a sentence or two.
    pub description: String,
}
