//! What a pre-flight says.

use serde::Serialize;

use crate::input_record::short_name;

dynid_record::words! {
    /// How much a finding matters.
    Severity {
        /// Good to know; identification takes care of it.
        Info = "info",
        /// Makes the result worse, or leaves something open.
        Warning = "warning",
        /// Makes nonsense of the result.
        Error = "error",
    }
}

/// One fault of a log.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct Finding {
    /// Which fault.
    pub id: FindingId,
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
    pub number: usize,
    /// What the corrected configuration says; empty if nothing has to change.
    #[serde(skip)]
    pub fixes: Vec<Fix>,
}

/// What an identification says by itself, in figures of its own.
const SAID_ANYWAY: [FindingId; 4] =
    [FindingId::ClockGap, FindingId::IdleJoint, FindingId::Spikes, FindingId::WeakExcitation];

impl Finding {
    /// Whether an identification has to tell of it: not what it says anyway or takes care of.
    pub fn counts(&self) -> bool {
        self.severity != Severity::Info && !SAID_ANYWAY.contains(&self.id)
    }

    /// The finding as a warning of an identification; `None` unless it counts.
    pub fn warning(&self) -> Option<String> {
        if !self.counts() {
            return None;
        }
        let joint = self.joint.as_ref().map_or_else(String::new, |j| format!(" of {j}"));
        Some(format!("{}: {}{joint}: {}", short_name(&self.log), self.id.plain(), self.evidence))
    }
}

dynid_record::words! {
    /// Faults that are looked for.
    FindingId {
        /// Gravity does not point where it is stated to.
        BaseTilt = "base_tilt",
        /// Rows whose time is not after every earlier one.
        ClockBackwards = "clock_backwards",
        /// Rows are missing.
        ClockGap = "clock_gap",
        /// Steps of the clock vary.
        ClockJitter = "clock_jitter",
        /// The time does not count seconds, or not well.
        ClockRate = "clock_rate",
        /// An effort of few values.
        CoarseSignal = "coarse_signal",
        /// Numbered columns whose joints no log can tell.
        ColumnOrder = "column_order",
        /// Positions in degrees that are taken for radians, or the other way round.
        Degrees = "degrees",
        /// Motion and effort of a row belong to different times.
        Delay = "delay",
        /// Efforts of another size than the robot asks for.
        DriveGain = "drive_gain",
        /// Rows that repeat the row before.
        DuplicateSamples = "duplicate_samples",
        /// Efforts that count the other way.
        EffortSign = "effort_sign",
        /// A signal that stays exactly the same.
        FrozenSignal = "frozen_signal",
        /// Gravity of another size than on Earth.
        GravitySize = "gravity_size",
        /// A joint that stands still.
        IdleJoint = "idle_joint",
        /// Columns of other joints.
        JointPermutation = "joint_permutation",
        /// Columns that were not tried in other ways.
        NotExamined = "not_examined",
        /// Positions that no joint reaches.
        PositionRange = "position_range",
        /// Positions that count the other way.
        PositionSign = "position_sign",
        /// Positions that jump by whole turns.
        PositionWrap = "position_wrap",
        /// Positions that count from another zero.
        PositionZero = "position_zero",
        /// Rows that two logs share.
        RepeatedLog = "repeated_log",
        /// Efforts cut off at a limit.
        Saturation = "saturation",
        /// Single samples off their neighbours.
        Spikes = "spikes",
        /// Efforts that no reading of the log explains.
        UnexplainedEffort = "unexplained_effort",
        /// Velocities that are no derivatives of the positions.
        VelocityMismatch = "velocity_mismatch",
        /// Motion that does not show all parameters.
        WeakExcitation = "weak_excitation",
    }
}

impl FindingId {
    /// The word in plain letters.
    pub fn plain(self) -> String {
        self.word().replace('_', " ")
    }
}

/// A change of the configuration.
#[derive(Debug, Clone, PartialEq)]
pub enum Fix {
    /// Columns stand for other joints, or have other factors: per joint, whose position and effort it is, with a factor.
    Wiring {
        /// What stands for what.
        wiring: dynid_rows::preflight::Wiring,
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
pub struct Findings<'a> {
    /// The log that is examined.
    pub log: &'a str,
    /// Its number among the logs of a run.
    pub number: usize,
    /// What was found so far.
    pub list: Vec<Finding>,
}

impl Findings<'_> {
    /// Adds a finding about the log that is examined, which the caller may complete.
    pub fn add(
        &mut self,
        id: FindingId,
        severity: Severity,
        joint: Option<&str>,
        evidence: String,
        remedy: &str,
    ) -> &mut Finding {
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
