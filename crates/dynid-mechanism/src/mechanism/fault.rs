//! What can be wrong or odd about a description.

use thiserror::Error;

use super::MAX_MOVING_JOINTS;

/// A structural fault of a description.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MechanismError {
    /// No link at all.
    #[error("robot `{robot}` has no links")]
    Empty {
        /// Robot name.
        robot: String,
    },
    /// No joint moves.
    #[error("robot `{robot}` has no moving joint")]
    NothingMoves {
        /// Robot name.
        robot: String,
    },
    /// A name is used twice.
    #[error("{what} name `{name}` is used more than once")]
    Duplicate {
        /// "link" or "joint".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A name holds a control character: files that other programs read, and terminals, do not bear it.
    #[error("{what} name {name:?}: expected no control characters")]
    ControlCharacter {
        /// "robot", "link" or "joint".
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that does not exist.
    #[error("joint `{joint}`: {role} link `{link}` does not exist")]
    MissingLink {
        /// Joint.
        joint: String,
        /// "parent" or "child".
        role: &'static str,
        /// The missing link.
        link: String,
    },
    /// A link is the child of two joints.
    #[error("link `{link}` is the child of two joints, `{first}` and `{second}`")]
    TwoParents {
        /// Link.
        link: String,
        /// First joint.
        first: String,
        /// Second joint.
        second: String,
    },
    /// More than one link has no parent.
    #[error("the robot has {count} root links (links that are no joint's child), expected one: `{first}`, `{second}`{}", if *count > 2 { ", ..." } else { "" })]
    ManyRoots {
        /// Number of roots.
        count: usize,
        /// First root.
        first: String,
        /// Second root.
        second: String,
    },
    /// Joints form a circle.
    #[error("joints form a cycle through link `{link}`")]
    Cycle {
        /// A link on the cycle.
        link: String,
    },
    /// The axis of a joint is zero.
    #[error("joint `{joint}`: axis is (0, 0, 0), expected a direction")]
    ZeroAxis {
        /// Joint.
        joint: String,
    },
    /// A number is NaN or infinite.
    #[error("{what} of `{name}` is not finite")]
    NotFinite {
        /// Name of the quantity.
        what: &'static str,
        /// Of which link or joint.
        name: String,
    },
    /// A mimic joint follows a joint that does not exist, does not move, or follows in turn without end.
    #[error("joint `{joint}` mimics `{of}`, {fault}")]
    Mimic {
        /// The mimic joint.
        joint: String,
        /// The leader.
        of: String,
        /// What is wrong.
        fault: &'static str,
    },
    /// More moving joints than [`MAX_MOVING_JOINTS`].
    #[error("the robot has {found} moving joints, at most {MAX_MOVING_JOINTS} are supported")]
    TooManyJoints {
        /// Number found.
        found: usize,
    },
    /// A link that was asked for does not exist.
    #[error("no link is named `{name}` (links: {})", known.join(", "))]
    UnknownLink {
        /// The name asked for.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
    /// A joint that was asked for does not exist or does not move.
    #[error("no moving joint is named `{name}` (joints: {})", known.join(", "))]
    UnknownJoint {
        /// The name asked for.
        name: String,
        /// Names that exist.
        known: Vec<String>,
    },
    /// A joint that cannot have clearance.
    #[error("joint `{joint}`: expected a revolute joint on its own for a clearance, found {found}")]
    NoJournal {
        /// Joint.
        joint: String,
        /// What it is.
        found: &'static str,
    },
}

/// An oddity of a robot file that does not keep it from being used.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum MechanismWarning {
    /// No mass distribution could have the stated inertia.
    #[error("body `{body}` {fault}: its stated inertia is used as a starting value only")]
    NotPhysical {
        /// Name of the moving link.
        body: String,
        /// What is wrong with it.
        fault: &'static str,
    },
    /// A moving link and all that is fixed to it state no inertia.
    #[error(
        "body `{body}` states no inertia: its parameters are unknown, taken as zero where a value is needed"
    )]
    NotStated {
        /// Name of the moving link.
        body: String,
    },
    /// A mimic joint is treated as a coordinate of its own.
    #[error(
        "joint `{joint}` mimics `{of}` in the file; it is treated as independent (ask for coupled mimic joints to change this)"
    )]
    MimicIndependent {
        /// The mimic joint.
        joint: String,
        /// Leader of the mimic joint.
        of: String,
    },
    /// A joint was locked because nothing moves it.
    #[error("joint `{joint}` is held at {position}")]
    Locked {
        /// Joint.
        joint: String,
        /// Held position, rad or m.
        position: f64,
    },
}
