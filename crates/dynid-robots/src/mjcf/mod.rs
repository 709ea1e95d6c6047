//! MJCF, the robot files of MuJoCo: reading, editing in place, writing.

mod actuator;
mod compiler;
mod defaults;
mod document;
mod edit;
mod equality;
mod fields;
mod geom;
mod inertia;
mod joint;
mod loops;
mod mesh;
mod model;
mod orientation;
mod parts;
mod read;
mod walk;
mod write;

pub use document::EditedFile;
pub use edit::edit;
pub use loops::Loops;
pub use read::{MjcfRobot, parse, parse_edited};
pub use write::{from_closed, from_description};

use crate::robot_error::RobotFileError;

/// Ranges from here on are none.
const NO_LIMIT: f64 = 1e10;
/// What helps where MuJoCo makes something of an element.
const FLATTEN: &str =
    "save the compiled model and give that file: `mujoco.mj_saveLastXML(\"flat.xml\", model)` in Python";
/// What helps where an inertia is not computed.
const SOLID: &str =
    "state an <inertial> in the body (`mujoco.mj_saveLastXML` writes those that MuJoCo computes)";
/// What helps with a constraint.
const REMOVE_OR_DISABLE: &str = "remove it, or write active=\"false\"";

/// What a joint of MJCF states about dissipation, rotor and spring, all of it on the drive's side of the effort:
/// `armature · q̈ + damping · q̇ + frictionloss · sign(q̇) + stiffness · (q - springref)`.
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
    /// Stiffness of a spring between the bodies `stiffness`, N m/rad or N/m.
    pub stiffness: f64,
    /// Position at which that spring is at rest `springref`, rad or m; 0 without a spring.
    pub spring_reference: f64,
}

/// A name as it stands between the quotes of an attribute.
pub fn escaped(name: &str) -> std::borrow::Cow<'_, str> {
    quick_xml::escape::escape(name)
}

fn unwritable(what: &'static str, name: &str, reason: String) -> RobotFileError {
    RobotFileError::Unwritable { format: "MJCF", what, name: name.to_owned(), reason }
}
