//! The keys of a robot in TOML, as serde sees them.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::number::{Angle, Number, Position};
use crate::law::LawSpec;
use crate::tie::TieSpec;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotToml {
    /// Version of the form of the file.
    #[serde(rename = "schema")]
    pub(super) _schema: Option<Schema>,
    /// Name of the robot. Default: the URDF's, else the name of the file.
    pub(super) name: Option<String>,
    /// Gravity in base axes, m/s². Default 0 0 -9.81.
    pub(super) gravity: Option<[Number; 3]>,
    /// Convention of the rows, needed beside `joint`.
    pub(super) dh: Option<Spanned<Dh>>,
    /// Rows of a DH table, from the base on.
    pub(super) joint: Option<Vec<Spanned<Row>>>,
    /// Massless link behind the last row. Default: none.
    pub(super) tool: Option<Spanned<Tool>>,
    /// Bodies of a tree, each with the joint that carries it.
    pub(super) body: Option<Vec<Spanned<Body>>>,
    /// URDF that holds the tree, relative to this file; in place of rows and bodies.
    pub(super) urdf: Option<Spanned<String>>,
    /// What closes loops of the tree.
    #[serde(rename = "loop")]
    #[serde(default)]
    pub(super) loops: Vec<Spanned<LoopToml>>,
    /// Links or joints whose joint floats, whatever its kind.
    #[serde(default)]
    pub(super) floating: Vec<Spanned<String>>,
    /// Put a floating joint under the root. Default false.
    #[serde(default)]
    pub(super) floating_base: bool,
    /// Let mimic joints follow their leaders. Default false.
    #[serde(default)]
    pub(super) couple_mimics: bool,
    /// Joints with drives. Default: as many as the mechanism needs, with a warning.
    pub(super) actuated: Option<Vec<Spanned<String>>>,
    /// Position of joints in the assembly that is meant: rad, m; of a floating joint `[x, y, z, qx, qy, qz, qw]`.
    #[serde(default)]
    pub(super) home: BTreeMap<Spanned<String>, Position>,
    /// Elements of every joint.
    #[serde(default)]
    pub(super) defaults: Defaults,
    /// Elements of single joints, `elements = [..]`, and stated values of elements.
    #[serde(default)]
    pub(super) element: BTreeMap<String, Spanned<toml::Table>>,
    /// Laws of friction of the file's own, which `elements` may name.
    #[serde(default)]
    pub(super) law: BTreeMap<String, Spanned<LawSpec>>,
    /// Joints that share motors.
    #[serde(default)]
    pub(super) coupling: Vec<Spanned<Coupling>>,
    /// Parameters that are known, or multiples or sums of others; a list of names says that they are equal.
    #[serde(default)]
    pub(super) tie: Vec<Spanned<TieSpec>>,
}

/// The version of the schema: 1.
#[derive(Deserialize)]
#[serde(try_from = "i64")]
pub(super) struct Schema;

impl TryFrom<i64> for Schema {
    type Error = String;

    fn try_from(version: i64) -> Result<Self, String> {
        if version == 1 { Ok(Schema) } else { Err(format!("schema: expected 1, found {version}")) }
    }
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum Dh {
    Modified,
    Standard,
}

/// A row of a DH table.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Row {
    /// Name of the joint.
    pub(super) name: String,
    /// Name of the link that it moves. Default `link<k>`.
    pub(super) link: Option<String>,
    /// Length `a`, m. Default 0.
    #[serde(default)]
    pub(super) a: Number,
    /// Twist `alpha`, rad. Default 0.
    #[serde(default)]
    pub(super) alpha: Angle,
    /// Offset `d` along z of a row that turns, m; a prismatic row has `offset`. Default 0.
    pub(super) d: Option<Number>,
    /// Angle `theta` of a prismatic row, rad; a row that turns has `offset`. Default 0.
    pub(super) theta: Option<Angle>,
    /// Offset of the position, rad or m. Default 0.
    #[serde(default)]
    pub(super) offset: Angle,
    /// Kind of the joint. Default `revolute`.
    #[serde(default)]
    pub(super) kind: RowKind,
    /// Limits of the joint.
    #[serde(default)]
    pub(super) limits: LimitsToml,
    /// Frame that the inertia of a standard DH row refers to. Default `joint`.
    #[serde(default)]
    pub(super) frame: Frame,
    /// Standard parameters `m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz` about the joint frame; in place of `mass`, `com`, `inertia_com`.
    pub(super) phi: Option<[Number; 10]>,
    /// Mass, kg.
    pub(super) mass: Option<Number>,
    /// Centre of mass in the joint frame, m.
    pub(super) com: Option<[Number; 3]>,
    /// Inertia `xx, xy, xz, yy, yz, zz` about the centre of mass, kg m².
    pub(super) inertia_com: Option<[Number; 6]>,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum RowKind {
    #[default]
    Revolute,
    Continuous,
    Prismatic,
}

/// The frame that a row's inertia refers to.
#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum Frame {
    #[default]
    Joint,
    Distal,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct LimitsToml {
    /// Least and largest position, rad or m.
    pub(super) position: Option<[Angle; 2]>,
    /// Largest speed, rad/s or m/s.
    pub(super) velocity: Option<Angle>,
    /// Largest effort, N m or N.
    pub(super) effort: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tool {
    /// Origin in the last frame, m. Default 0 0 0.
    #[serde(default)]
    pub(super) xyz: [Number; 3],
    /// Roll, pitch, yaw, rad. Default 0 0 0.
    #[serde(default)]
    pub(super) rpy: [Angle; 3],
}

/// A body of a tree and the joint that carries it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    /// Name of the link.
    pub(super) name: String,
    /// Link that carries it; the root is `ground`.
    pub(super) parent: String,
    /// Joint between both.
    pub(super) joint: BodyJoint,
    /// Standard parameters `m, mx, my, mz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz` about the joint frame; in place of `mass`, `com`, `inertia_com`.
    pub(super) phi: Option<[Number; 10]>,
    /// Mass, kg.
    pub(super) mass: Option<Number>,
    /// Centre of mass in the joint frame, m.
    pub(super) com: Option<[Number; 3]>,
    /// Inertia `xx, xy, xz, yy, yz, zz` about the centre of mass, kg m².
    pub(super) inertia_com: Option<[Number; 6]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyJoint {
    /// Name of the joint. Default: the link's.
    pub(super) name: Option<String>,
    /// Kind of the joint. Default `revolute`.
    #[serde(default)]
    pub(super) kind: BodyKind,
    /// Origin in the frame of the parent, m. Default 0 0 0.
    #[serde(default)]
    pub(super) xyz: [Number; 3],
    /// Roll, pitch, yaw of the joint frame, rad. Default 0 0 0.
    #[serde(default)]
    pub(super) rpy: [Angle; 3],
    /// Axis in the joint frame. Default 0 0 1.
    pub(super) axis: Option<[Number; 3]>,
    /// Travel of a helical joint per turn in rad, m/rad.
    pub(super) pitch: Option<Number>,
    /// Limits of the joint.
    #[serde(default)]
    pub(super) limits: LimitsToml,
}

#[derive(Clone, Copy, Default, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub(super) enum BodyKind {
    #[default]
    Revolute,
    Continuous,
    Prismatic,
    Helical,
    Floating,
    Fixed,
}

/// What closes a loop.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table with `name`, `kind` and the keys of the kind")]
pub(super) struct LoopToml {
    /// Name of the closure.
    pub(super) name: String,
    /// What the closure demands.
    pub(super) kind: LoopKind,
    /// First link.
    pub(super) a: Option<Spanned<String>>,
    /// Second link.
    pub(super) b: Option<Spanned<String>>,
    /// Origin of the frame on `a`, m. Default 0 0 0.
    pub(super) a_xyz: Option<Spanned<[Number; 3]>>,
    /// Roll, pitch, yaw of that frame, rad. Default 0 0 0.
    pub(super) a_rpy: Option<Spanned<[Angle; 3]>>,
    /// Origin of the frame on `b`, m. Default 0 0 0.
    pub(super) b_xyz: Option<Spanned<[Number; 3]>>,
    /// Roll, pitch, yaw of that frame, rad. Default 0 0 0.
    pub(super) b_rpy: Option<Spanned<[Angle; 3]>>,
    /// Length of a `distance`, m.
    pub(super) length: Option<Spanned<Number>>,
    /// Factors of joints in a `coordinate`, `Σ factor q = constant`.
    pub(super) terms: Option<Spanned<BTreeMap<Spanned<String>, Number>>>,
    /// Right-hand side of a `coordinate`, rad or m. Default 0.
    pub(super) constant: Option<Spanned<Angle>>,
}

#[derive(Clone, Copy, Deserialize, PartialEq)]
#[serde(rename_all = "snake_case")]
pub(super) enum LoopKind {
    #[serde(alias = "point")]
    Spherical,
    PlanarRevolute,
    Revolute,
    Universal,
    Cylindrical,
    Prismatic,
    PlanarPrismatic,
    Fixed,
    Distance,
    Coordinate,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Defaults {
    /// Elements of every joint. Default: none stated.
    #[serde(default)]
    pub(super) elements: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Coupling {
    /// Names of the motors, one per row of `matrix`.
    pub(super) motors: Vec<String>,
    /// Joints that they move, one per column.
    pub(super) joints: Vec<String>,
    /// Motor speeds per joint speeds.
    pub(super) matrix: Vec<Vec<Number>>,
    /// Whether motors keep parameters for themselves or add columns. Default `strict`.
    #[serde(default)]
    pub(super) form: CouplingForm,
}

/// The ways to state an inertia, copied out of a row or body.
#[derive(Clone, Copy)]
pub(super) struct BodyInertia {
    pub(super) phi: Option<[Number; 10]>,
    pub(super) mass: Option<Number>,
    pub(super) com: Option<[Number; 3]>,
    pub(super) inertia_com: Option<[Number; 6]>,
}

impl Row {
    pub(super) fn stated_inertia(&self) -> BodyInertia {
        BodyInertia { phi: self.phi, mass: self.mass, com: self.com, inertia_com: self.inertia_com }
    }
}

impl Body {
    pub(super) fn stated_inertia(&self) -> BodyInertia {
        BodyInertia { phi: self.phi, mass: self.mass, com: self.com, inertia_com: self.inertia_com }
    }
}

/// Parameters of a coupling.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Eq, serde::Serialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CouplingForm {
    /// One inertia, viscous and Coulomb parameter per motor, carried through the matrix.
    #[default]
    Strict,
    /// Three extra columns beside the direct terms of the joints, as in the literature on the TX40.
    Columns,
}
