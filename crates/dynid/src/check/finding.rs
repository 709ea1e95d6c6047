//! What a pre-flight says.

use serde::Serialize;

use crate::caution::Caution;

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

impl Severity {
    /// `info`, `warning` or `error`.
    pub fn word(self) -> &'static str {
        match self {
            Severity::Info => "info",
            Severity::Warning => "warning",
            Severity::Error => "error",
        }
    }
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

/// What an identification says by itself, in figures of its own.
const SAID_ANYWAY: [&str; 4] = ["clock_gap", "idle_joint", "spikes", "weak_excitation"];

impl Finding {
    /// Whether an identification has to tell of it: not what it says anyway or takes care of.
    pub(crate) fn counts(&self) -> bool {
        self.severity != Severity::Info && !SAID_ANYWAY.contains(&self.id)
    }

    /// The finding as a caution of an identification; `None` unless it counts.
    pub(crate) fn caution(&self) -> Option<Caution> {
        let message = self.warning()?;
        let status = if self.severity == Severity::Error { "fail" } else { "warn" };
        let caution = Caution::warn(&self.id.replace('_', " "), message, &*self.remedy);
        Some(Caution { status: status.to_owned(), ..caution })
    }

    /// The finding as a warning of an identification; `None` unless it counts.
    pub(crate) fn warning(&self) -> Option<String> {
        if !self.counts() {
            return None;
        }
        let joint = self.joint.as_ref().map_or_else(String::new, |j| format!(" of {j}"));
        Some(format!("{}: {}{joint}: {}", super::short(&self.log), self.id.replace('_', " "), self.evidence))
    }
}

/// Faults that are looked for.
pub const IDS: [&str; 27] = [
    "base_tilt",
    "clock_backwards",
    "clock_gap",
    "clock_jitter",
    "clock_rate",
    "coarse_signal",
    "column_order",
    "degrees",
    "delay",
    "drive_gain",
    "duplicate_samples",
    "effort_sign",
    "frozen_signal",
    "gravity_size",
    "idle_joint",
    "joint_permutation",
    "not_examined",
    "position_range",
    "position_sign",
    "position_wrap",
    "position_zero",
    "repeated_log",
    "saturation",
    "spikes",
    "unexplained_effort",
    "velocity_mismatch",
    "weak_excitation",
];

/// A change of the configuration.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Fix {
    /// Columns stand for other joints, or have other factors: per joint, whose position and effort it is, with a factor.
    Wiring {
        /// What stands for what.
        wiring: dynid_estimate::preflight::Wiring,
        /// Whether velocities go with positions.
        velocities: bool,
    },
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
    /// Times are to be multiplied by a factor.
    Clock(f64),
    /// The log is to be left out.
    Drop,
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
