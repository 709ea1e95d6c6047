//! What a motion leaves behind as JSON.

use dynid_identify::estimate::Provenance;
use dynid_motion::trajectory::{MotionLimits, Quantity};
use serde::Serialize;

use super::parts::Ranges;

/// Schema of `motion.json`.
pub(super) const SCHEMA: &str = "dynid-motion/1";

dynid_record::words! {
    /// Kinds of parts.
    PartKind {
        /// Constant speeds of one joint.
        Sweep = "sweep",
        /// Small sinusoids of one joint.
        Presliding = "presliding",
        /// Lines between points with blended corners.
        Track = "track",
        /// A point on a circle.
        Circle = "circle",
        /// Rest.
        Pause = "pause",
    }
}

dynid_record::words! {
    /// Quantities that are limited.
    LimitedQuantity {
        /// Position, rad or m.
        Position = "position",
        /// Velocity, rad/s or m/s.
        Velocity = "velocity",
        /// Acceleration, rad/s² or m/s².
        Acceleration = "acceleration",
        /// Jerk, rad/s³ or m/s³.
        Jerk = "jerk",
    }
}

impl From<Quantity> for LimitedQuantity {
    fn from(quantity: Quantity) -> Self {
        match quantity {
            Quantity::Position => LimitedQuantity::Position,
            Quantity::Velocity => LimitedQuantity::Velocity,
            Quantity::Acceleration => LimitedQuantity::Acceleration,
            Quantity::Jerk => LimitedQuantity::Jerk,
        }
    }
}

/// `motion.json`: keys are added, never renamed.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct MotionRecord {
    /// Schema and version.
    pub schema: &'static str,
    /// Robot file.
    pub robot: String,
    /// Joints in the order of every "per joint" list.
    pub joints: Vec<String>,
    /// One sentence.
    pub headline: String,
    /// Duration, s.
    pub duration_s: f64,
    /// Rate, Hz.
    pub sample_rate_hz: f64,
    /// Samples of the files.
    pub samples: usize,
    /// Pose in which the motion begins and ends, per joint, rad or m.
    pub start: Vec<f64>,
    /// Parts in the order in which they run.
    pub parts: Vec<PartRecord>,
    /// What the motion uses of every limit, between samples too.
    pub limits: Vec<LimitUse>,
    /// Columns of loads.
    pub loads: Vec<LoadRecord>,
    /// What to know before the motion is run.
    pub warnings: Vec<String>,
    /// Where all this comes from.
    pub provenance: Provenance,
}

/// A part as it runs.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PartRecord {
    /// Number, from 1: the column `part` of the files.
    pub number: usize,
    /// Name.
    pub name: String,
    /// What it is.
    pub kind: PartKind,
    /// Joint that moves alone, if one does.
    pub joint: Option<String>,
    /// How often it runs.
    pub repeat: usize,
    /// Begin of the first time, s.
    pub from_s: f64,
    /// End of the last time, s.
    pub to_s: f64,
    /// How many times slower it runs than asked for, to keep limits: 1 as asked for.
    pub slowed: f64,
    /// Constant speeds, in the order of time.
    pub passes: Vec<PassRecord>,
}

/// A stretch of constant speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, schemars::JsonSchema)]
pub struct PassRecord {
    /// Speed, signed, rad/s or m/s.
    pub speed: f64,
    /// Begin, s.
    pub from_s: f64,
    /// End, s.
    pub to_s: f64,
}

/// A limit and what the motion uses of it.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LimitUse {
    /// Joint.
    pub joint: String,
    /// What is limited.
    pub quantity: LimitedQuantity,
    /// Lower limit.
    pub lower: f64,
    /// Upper limit.
    pub upper: f64,
    /// Least value of the motion.
    pub least: f64,
    /// Greatest value.
    pub most: f64,
    /// Share of the limit that is used, of half the range about its middle for positions.
    pub used: f64,
}

/// A column of loads.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct LoadRecord {
    /// Joint.
    pub joint: String,
    /// Column of the table.
    pub column: String,
    /// The load opposes motion in either direction; else it counts positive against positive motion.
    pub brake: bool,
    /// Least load, N m or N.
    pub least: f64,
    /// Greatest load, N m or N.
    pub most: f64,
    /// An element of the robot file reads it.
    pub is_read: bool,
}

/// Uses of the limits that there are.
pub(super) fn uses(joints: &[String], limits: &[MotionLimits], ranges: &Ranges) -> Vec<LimitUse> {
    let mut out = Vec::new();
    for ((joint, limits), ranges) in joints.iter().zip(limits).zip(ranges) {
        for (quantity, (least, most)) in Quantity::ALL.into_iter().zip(ranges) {
            let (lower, upper) = limits.of(quantity);
            if !(lower.is_finite() && upper.is_finite()) {
                continue;
            }
            out.push(LimitUse {
                joint: joint.clone(),
                quantity: quantity.into(),
                lower,
                upper,
                least: *least,
                most: *most,
                used: 1.0 + limits.excess(quantity, (*least, *most)),
            });
        }
    }
    out
}
