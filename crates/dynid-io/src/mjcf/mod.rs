//! MJCF, the robot files of MuJoCo: writing, and reading back what is written.

mod loops;
mod quaternion;
mod read;
mod write;

pub use loops::Loops;
pub use read::{MjcfRobot, parse};
pub use write::{from_closed, from_description};

use crate::robot_error::RobotFileError;

/// What a joint of MJCF states about dissipation and rotor, all of it on the drive's side of the effort:
/// `armature · q̈ + damping · q̇ + frictionloss · sign(q̇)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointParameters {
    /// Joint.
    pub joint: String,
    /// Viscous friction `damping`, N m s/rad or N s/m.
    pub damping: f64,
    /// Coulomb friction `frictionloss`, N m or N.
    pub friction_loss: f64,
    /// Rotor inertia behind the gear `armature`, kg m² or kg.
    pub armature: f64,
}

fn unwritable(what: &'static str, name: &str, reason: String) -> RobotFileError {
    RobotFileError::Unwritable { format: "MJCF", what, name: name.to_owned(), reason }
}
