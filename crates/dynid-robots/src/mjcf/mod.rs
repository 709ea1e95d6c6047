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
    /// Whether the joint sticks: MuJoCo's own dry friction is soft and creeps, unless `solreffriction` and `solimpfriction` say otherwise. Written, never read.
    pub sticks: bool,
    /// A gear that gives way between what the joint's drive moves and the link: a second joint on the same axis. Written, never read.
    pub gear: Option<GearJoint>,
}

/// A position loop that MJCF states as an actuator of a joint: `force = position_gain (ctrl - q) - velocity_gain q̇ + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionActuator {
    /// Joint.
    pub joint: String,
    /// `kp`, N m/rad or N/m.
    pub position_gain: f64,
    /// `kv`, N m s/rad or N s/m.
    pub velocity_gain: f64,
    /// Constant force, N m or N.
    pub offset: f64,
    /// Largest force, if it is limited.
    pub effort_limit: Option<f64>,
    /// Controls that it takes, if it clamps them.
    pub command_limits: Option<(f64, f64)>,
}

/// Dry friction as hard as MuJoCo has it, for joints that do not say how hard theirs is: a time constant below two steps of the simulation is taken for two.
const STICKING: [(&str, &str); 2] =
    [("solreffriction", "0.0004 1"), ("solimpfriction", "0.9999 0.9999 0.001")];

/// A gear that gives way, as a joint `<joint>_gear` behind the drive's own: the link's position is the sum of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GearJoint {
    /// Stiffness, N m/rad or N/m.
    pub stiffness: f64,
    /// Damping, N m s/rad or N s/m; with backlash on the flanks alone.
    pub damping: f64,
    /// From flank to flank, rad or m.
    pub backlash: f64,
    /// Acceleration of the gear joint per effort on it, everything else free, where the model is as drawn (MuJoCo's `dof_invweight0`), 1/(kg m²) or 1/kg. It
    /// matters with backlash alone.
    pub mobility: f64,
}

impl GearJoint {
    /// Name of the joint.
    pub fn name(joint: &str) -> String {
        format!("{joint}_gear")
    }

    /// Attributes of the joint beside name, type, axis and place; angles in `unit` rad.
    ///
    /// A spring does for gears without backlash. Flanks are limits of the joint: a constraint of impedance `d` has the force `-(d/A)(b v + k d r + a)` with the
    /// inverse inertia `A` that `mobility` states and the acceleration `a` without it, so that direct `solref` `(-K A, -D A)` gives a flank of stiffness `K` and damping `D` but
    /// for the share `d` of the inertial forces, here 1e-4, the least that is allowed.
    fn attributes(&self, unit: f64) -> String {
        let GearJoint { stiffness, damping, backlash, mobility } = *self;
        let none = "armature=\"0\" frictionloss=\"0\" ref=\"0\" springref=\"0\"";
        if backlash <= 0.0 {
            return format!("{none} limited=\"false\" stiffness=\"{stiffness:?}\" damping=\"{damping:?}\"");
        }
        let half = 0.5 * backlash / unit;
        format!(
            "{none} stiffness=\"0\" damping=\"0\" limited=\"true\" range=\"{:?} {half:?}\" margin=\"0\" solreflimit=\"{:?} {:?}\" solimplimit=\"0.0001 0.0001 0.001\"",
            -half,
            -stiffness * mobility,
            -damping * mobility
        )
    }

    fn is_finite(&self) -> bool {
        [self.stiffness, self.damping, self.backlash, self.mobility].iter().all(|x| x.is_finite())
    }
}

/// A name as it stands between the quotes of an attribute.
pub fn escaped(name: &str) -> std::borrow::Cow<'_, str> {
    quick_xml::escape::escape(name)
}

fn unwritable(what: &'static str, name: &str, reason: String) -> RobotFileError {
    RobotFileError::Unwritable { format: "MJCF", what, name: name.to_owned(), reason }
}
