//! What a robot file says, before it is checked and compiled into a [`Mechanism`](crate::Mechanism).

use dynid_algebra::inertia::Inertia;
use dynid_algebra::spatial::Placement;

/// Kind of a joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointKind {
    /// Rotation about the axis within limits; position in rad.
    Revolute,
    /// Rotation about the axis without limits; position in rad, not wrapped.
    Continuous,
    /// Translation along the axis; position in m.
    Prismatic,
    /// Rotation about and translation along the axis together; position in rad, `pitch` in m/rad.
    Helical {
        /// Translation per rotation, m/rad.
        pitch: f64,
    },
    /// Six degrees of freedom. Position `x y z qx qy qz qw` (m, unit quaternion); rates: velocity of the origin (m/s),
    /// then angular velocity (rad/s), both in body axes.
    Floating,
    /// No motion: the child is merged into the parent.
    Fixed,
}

/// Limits of a joint as stated by the file; `None` where nothing is stated.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Lower and upper position, rad or m.
    pub position: Option<(f64, f64)>,
    /// Largest speed, rad/s or m/s.
    pub velocity: Option<f64>,
    /// Largest effort, N m or N.
    pub effort: Option<f64>,
}

/// A joint that follows another: `position = ratio · position(of) + offset`.
#[derive(Clone, Debug, PartialEq)]
pub struct Mimic {
    /// Name of the joint that is followed.
    pub of: String,
    /// Factor.
    pub ratio: f64,
    /// Offset, rad or m.
    pub offset: f64,
}

/// A link as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkDescription {
    /// Name, unique among links.
    pub name: String,
    /// Inertia about the link frame; `None` if the file states none.
    pub inertia: Option<Inertia>,
}

/// A joint as a file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct JointDescription {
    /// Name, unique among joints.
    pub name: String,
    /// Name of the parent link.
    pub parent: String,
    /// Name of the child link.
    pub child: String,
    /// Kind of motion.
    pub kind: JointKind,
    /// Frame of the joint (and of the child link at position zero) in the parent link.
    pub placement: Placement,
    /// Axis of motion in the joint frame; any length but zero. Ignored for fixed and floating joints.
    pub axis: [f64; 3],
    /// Limits.
    pub limits: Limits,
    /// The joint that this one follows, if the file says so.
    pub mimic: Option<Mimic>,
}

/// Links and joints of a robot in the order of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// Name of the robot.
    pub name: String,
    /// Acceleration of gravity in base axes, m/s².
    pub gravity: [f64; 3],
    /// Links.
    pub links: Vec<LinkDescription>,
    /// Joints; their order is the order of coordinates.
    pub joints: Vec<JointDescription>,
    /// Put a floating joint named `root_joint` between the world and the root link.
    pub floating_base: bool,
    /// Make `mimic` joints follow their leader. Off: every mimic joint is a coordinate of its own.
    pub couple_mimics: bool,
}

/// Ordinary gravity, along -z of the base, m/s².
pub const STANDARD_GRAVITY: [f64; 3] = [0.0, 0.0, -9.81];

impl Description {
    /// An empty description with gravity along -z.
    pub fn new(name: impl Into<String>) -> Self {
        Description {
            name: name.into(),
            gravity: STANDARD_GRAVITY,
            links: Vec::new(),
            joints: Vec::new(),
            floating_base: false,
            couple_mimics: false,
        }
    }
}
