//! What a pre-flight says.

use serde::Serialize;

/// How much a finding matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Good to know; identification takes care of it.
    Info,
    /// Makes the result worse, or leaves something open.
    Warning,
    /// Makes nonsense of the result.
    Error,
}

/// One fault of a log.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Finding {
    /// Which fault: one of [`IDS`].
    pub id: &'static str,
    /// How much it matters.
    pub severity: Severity,
    /// Joint; `None` if it is none's own.
    pub joint: Option<String>,
    /// Log file.
    pub log: String,
    /// What was measured.
    pub evidence: String,
    /// What to do.
    pub remedy: String,
    /// Number of the log.
    #[serde(skip)]
    pub(super) number: usize,
    /// What the corrected configuration says; empty if nothing has to change.
    #[serde(skip)]
    pub(super) fixes: Vec<Fix>,
}

/// Faults that are looked for.
pub const IDS: [&str; 20] = [
    "base_tilt",
    "clock_backwards",
    "clock_gap",
    "clock_jitter",
    "clock_rate",
    "coarse_signal",
    "degrees",
    "delay",
    "drive_gain",
    "duplicate_samples",
    "effort_sign",
    "frozen_signal",
    "idle_joint",
    "joint_permutation",
    "not_examined",
    "position_sign",
    "saturation",
    "spikes",
    "velocity_mismatch",
    "weak_excitation",
];

/// A change of the configuration.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fix {
    /// Columns stand for other joints, or have other factors: per joint, whose position and effort it is, with a factor.
    Wiring(dynid_estimate::preflight::Wiring),
    /// Velocities are to be multiplied by a factor, joint by joint.
    VelocityScale(usize, f64),
    /// Data rows to leave out, from 1, both included.
    LeaveOut(Vec<(usize, usize)>),
    /// Rows that repeat the row before are to be dropped.
    DropRepeated,
    /// The motion is later than the effort by so many samples.
    Delay(f64),
    /// Gravity in base axes.
    Gravity([f64; 3]),
    /// Rows per second, in place of the time column.
    Rate(f64),
}

/// A finding of a log.
pub(super) struct Findings<'a> {
    pub(super) log: &'a str,
    pub(super) number: usize,
    pub(super) list: Vec<Finding>,
}

impl Findings<'_> {
    pub(super) fn add(
        &mut self,
        id: &'static str,
        severity: Severity,
        joint: Option<&str>,
        evidence: String,
        remedy: &str,
    ) -> &mut Finding {
        debug_assert!(IDS.contains(&id), "{id}");
        self.list.push(Finding {
            id,
            severity,
            joint: joint.map(str::to_owned),
            log: self.log.to_owned(),
            number: self.number,
            evidence,
            remedy: remedy.to_owned(),
            fixes: Vec::new(),
        });
        let last = self.list.len() - 1;
        &mut self.list[last]
    }
}
