//! What can be wrong with the loops of a mechanism.

use crate::mechanism::MechanismError;
use thiserror::Error;

/// A motion of coordinates, for messages: names with their shares, the largest first.
#[derive(Clone, Debug, PartialEq)]
pub struct NamedMotion(pub Vec<(String, f64)>);

impl std::fmt::Display for NamedMotion {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (k, (name, share)) in self.0.iter().enumerate() {
            let separator = if k == 0 { "" } else { ", " };
            write!(f, "{separator}`{name}` {share:+.3}")?;
        }
        Ok(())
    }
}

/// A fault of closures, of the choice of drives, or of the home position.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ClosedError {
    /// A link or joint that does not exist.
    #[error(transparent)]
    Mechanism(#[from] MechanismError),
    /// Two closures with one name.
    #[error("loop name `{closure}` is used more than once")]
    Duplicate {
        /// The name.
        closure: String,
    },
    /// Both ends on one body.
    #[error("loop `{closure}` joins a body to itself: links `{a}` and `{b}` move together")]
    SameBody {
        /// Closure.
        closure: String,
        /// Link of frame `a`.
        a: String,
        /// Link of frame `b`.
        b: String,
    },
    /// A rod without length.
    #[error("loop `{closure}`: expected a positive length, found {found}")]
    Length {
        /// Closure.
        closure: String,
        /// Length, m.
        found: f64,
    },
    /// A number that is not finite.
    #[error("loop `{closure}`: a number is not finite")]
    NotFinite {
        /// Closure.
        closure: String,
    },
    /// A coupling of no coordinate.
    #[error("loop `{closure}`: expected a factor other than zero, found none")]
    NoTerms {
        /// Closure.
        closure: String,
    },
    /// A coupling with a floating joint.
    #[error("loop `{closure}`: joint `{joint}` floats, only joints with one coordinate can be coupled")]
    FloatingTerm {
        /// Closure.
        closure: String,
        /// Joint.
        joint: String,
    },
    /// Nothing to close.
    #[error("the mechanism has no loops")]
    NoClosures,
    /// Mimic joints are coupled and loops are closed.
    #[error(
        "joint `{joint}` mimics another and the mechanism has loops: state the coupling as a loop of kind `coordinate`"
    )]
    Mimic {
        /// A mimic joint.
        joint: String,
    },
    /// A joint with other than one coordinate is to be driven.
    #[error("joint `{joint}` floats and cannot be {role}")]
    Floating {
        /// Joint.
        joint: String,
        /// "driven" or "independent".
        role: &'static str,
    },
    /// A joint is named twice.
    #[error("joint `{joint}` is named twice among the {role} joints")]
    NamedTwice {
        /// Joint.
        joint: String,
        /// "driven" or "independent".
        role: &'static str,
    },
    /// A home position with the wrong number of values.
    #[error("home of joint `{joint}`: expected {expected} finite numbers, found {found}")]
    Home {
        /// Joint.
        joint: String,
        /// Number of positions.
        expected: usize,
        /// What there is.
        found: String,
    },
    /// The loops do not close near the home position.
    #[error(
        "loop `{closure}` does not close near the home position: a gap of {gap} remains; \
         expected a home position within about 0.1 rad and 0.1 m of a closed one, and lengths that fit"
    )]
    NotClosed {
        /// Closure with the largest gap.
        closure: String,
        /// The gap with its unit.
        gap: String,
    },
    /// Loops close with an axis the wrong way round.
    #[error(
        "loop `{closure}` closes with an axis turned round at the home position: turn frame `a` or `b` by 180 degrees, or move the home position"
    )]
    Flipped {
        /// Closure.
        closure: String,
    },
    /// The loops leave nothing that can move.
    #[error("the loops leave no motion: {rows} independent conditions on {rates} coordinates")]
    Immobile {
        /// Rank of the conditions.
        rows: usize,
        /// Number of coordinates.
        rates: usize,
    },
    /// Fewer drives than motions.
    #[error(
        "{drives} driven joints for a mechanism with {mobility} free motions: no drive controls {motion}"
    )]
    UnderActuated {
        /// Number of driven joints.
        drives: usize,
        /// Mobility.
        mobility: usize,
        /// A motion that no drive controls.
        motion: NamedMotion,
    },
    /// The chosen coordinates do not determine the pose.
    #[error("the {role} joints do not determine the motion: with all of them held, {motion} remains")]
    Dependent {
        /// "driven" or "independent".
        role: &'static str,
        /// What remains.
        motion: NamedMotion,
    },
    /// The number of independent coordinates is not the mobility.
    #[error(
        "expected {mobility} independent joints, as many as the mechanism has free motions, found {found}"
    )]
    IndependentCount {
        /// Mobility.
        mobility: usize,
        /// Number stated.
        found: usize,
    },
    /// The home position is singular.
    #[error(
        "the home position is singular for the {role} joints (measure {measure:.1e}, at least {least:.0e} is needed): held, they leave {motion}"
    )]
    SingularHome {
        /// "driven" or "independent".
        role: &'static str,
        /// Smallest over largest singular value.
        measure: f64,
        /// Least allowed.
        least: f64,
        /// The motion.
        motion: NamedMotion,
    },
}

/// An oddity of a closed mechanism that does not stop work.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum ClosedWarning {
    /// Conditions that others imply.
    #[error("loops state {rows} conditions of which {rank} are independent: forces of {} are not determined and are shared out with the least norm", closures.iter().map(|c| format!("`{c}`")).collect::<Vec<_>>().join(", "))]
    Redundant {
        /// Number of rows.
        rows: usize,
        /// Rank of the rows.
        rank: usize,
        /// Closures with a multiplier that is not determined.
        closures: Vec<String>,
    },
    /// More drives than motions.
    #[error(
        "{drives} drives for {mobility} free motions: their efforts are determined up to internal load and are shared out with the least norm"
    )]
    OverActuated {
        /// Number of driven joints.
        drives: usize,
        /// Mobility.
        mobility: usize,
    },
    /// The file does not say which joints are driven.
    #[error("no joint is stated to be driven: {} are taken", joints.iter().map(|c| format!("`{c}`")).collect::<Vec<_>>().join(", "))]
    DrivesChosen {
        /// Chosen joints.
        joints: Vec<String>,
    },
    /// The home position was moved to close the loops.
    #[error("the home position was moved by up to {largest:.2e} (rad or m) to close the loops")]
    HomeMoved {
        /// Largest change of a coordinate.
        largest: f64,
    },
}

/// Why a pose was not reached.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum PoseError {
    /// A coordinate is not finite.
    #[error("position of `{joint}` is not finite")]
    NotFinite {
        /// Joint.
        joint: String,
    },
    /// No closed pose has these coordinates.
    #[error(
        "the loops cannot close: `{closure}` keeps a gap of {gap} (out of reach, or past a singular pose)"
    )]
    OutOfReach {
        /// Closure with the largest gap.
        closure: String,
        /// The gap with its unit.
        gap: String,
    },
    /// The pose belongs to another assembly mode than the home position.
    #[error("the pose belongs to another assembly mode than the home position")]
    OtherMode,
    /// Too near to a singular pose.
    #[error(
        "the pose is singular (measure {measure:.1e}, at least {least:.0e} is needed): with the independent joints held, {motion} is free"
    )]
    Singular {
        /// Smallest over largest singular value of the scaled Jacobian of the dependent coordinates.
        measure: f64,
        /// Least allowed.
        least: f64,
        /// The motion that is free there.
        motion: NamedMotion,
    },
}
