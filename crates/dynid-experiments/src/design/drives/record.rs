//! Where commands lead a robot, in the record of a design.

use dynid_drives::ServoGroupRecord;
use serde::Serialize;

/// Where commands lead a robot, by simulation of its drives.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct FollowedRecord {
    /// Joints.
    pub joints: Vec<FollowedJoint>,
    /// Limits of places (floor, own links, `[[keep]]`, capsules) that the command keeps and the simulated robot breaks.
    pub breaks: Vec<BrokenBehind>,
    /// Parameters that will be known together only.
    pub groups: Vec<ServoGroupRecord>,
    /// Parameters that no reading depends on.
    pub unseen: Vec<String>,
}

/// A limit that the command keeps and the simulated robot breaks.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct BrokenBehind {
    /// What is limited.
    pub kind: String,
    /// Whose: link, or pair of links.
    pub subject: String,
    /// By how much, m.
    pub by_m: f64,
}

/// Where commands lead a joint. Units are rad or m, s, N m or N.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct FollowedJoint {
    /// Joint.
    pub joint: String,
    /// RMS of the command less the reading.
    pub behind_rms: f64,
    /// Least and largest position.
    pub position: [f64; 2],
    /// Largest speed.
    pub speed: f64,
    /// Largest effort of the drive.
    pub effort: f64,
    /// Share of the samples at which the effort is at the drive's limit.
    pub at_limit: f64,
    /// Direction of command and encoder against the joint, 1 or -1.
    pub direction: f64,
    /// Position of the joint where its encoder reads zero: the drive is told `direction (q - zero)`.
    pub zero: f64,
}
