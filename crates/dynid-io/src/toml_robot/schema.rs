//! The keys of a robot in TOML, as serde sees them.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use super::elements::CouplingForm;
use super::number::{Angle, Number, Position};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotToml {
    #[serde(rename = "schema")]
    pub(super) _schema: Option<Schema>,
    pub(super) name: Option<String>,
    pub(super) gravity: Option<[Number; 3]>,
    pub(super) dh: Option<Spanned<Dh>>,
    pub(super) joint: Option<Vec<Spanned<Row>>>,
    pub(super) tool: Option<Spanned<Tool>>,
    pub(super) body: Option<Vec<Spanned<Body>>>,
    pub(super) urdf: Option<Spanned<String>>,
    #[serde(rename = "loop")]
    #[serde(default)]
    pub(super) loops: Vec<Spanned<LoopToml>>,
    #[serde(default)]
    pub(super) floating: Vec<Spanned<String>>,
    #[serde(default)]
    pub(super) floating_base: bool,
    #[serde(default)]
    pub(super) couple_mimics: bool,
    pub(super) actuated: Option<Vec<Spanned<String>>>,
    #[serde(default)]
    pub(super) home: BTreeMap<Spanned<String>, Position>,
    #[serde(default)]
    pub(super) defaults: Defaults,
    #[serde(default)]
    pub(super) element: BTreeMap<String, Spanned<toml::Table>>,
    #[serde(default)]
    pub(super) coupling: Vec<Spanned<Coupling>>,
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
    pub(super) name: String,
    pub(super) link: Option<String>,
    #[serde(default)]
    pub(super) a: Number,
    #[serde(default)]
    pub(super) alpha: Angle,
    pub(super) d: Option<Number>,
    pub(super) theta: Option<Angle>,
    #[serde(default)]
    pub(super) offset: Angle,
    #[serde(default)]
    pub(super) kind: RowKind,
    #[serde(default)]
    pub(super) limits: LimitsToml,
    #[serde(default)]
    pub(super) frame: Frame,
    pub(super) phi: Option<[Number; 10]>,
    pub(super) mass: Option<Number>,
    pub(super) com: Option<[Number; 3]>,
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
    pub(super) position: Option<[Angle; 2]>,
    pub(super) velocity: Option<Angle>,
    pub(super) effort: Option<Number>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Tool {
    #[serde(default)]
    pub(super) xyz: [Number; 3],
    #[serde(default)]
    pub(super) rpy: [Angle; 3],
}

/// A body of a tree and the joint that carries it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Body {
    pub(super) name: String,
    pub(super) parent: String,
    pub(super) joint: BodyJoint,
    pub(super) phi: Option<[Number; 10]>,
    pub(super) mass: Option<Number>,
    pub(super) com: Option<[Number; 3]>,
    pub(super) inertia_com: Option<[Number; 6]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyJoint {
    pub(super) name: Option<String>,
    #[serde(default)]
    pub(super) kind: BodyKind,
    #[serde(default)]
    pub(super) xyz: [Number; 3],
    #[serde(default)]
    pub(super) rpy: [Angle; 3],
    pub(super) axis: Option<[Number; 3]>,
    pub(super) pitch: Option<Number>,
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
    pub(super) name: String,
    pub(super) kind: LoopKind,
    pub(super) a: Option<Spanned<String>>,
    pub(super) b: Option<Spanned<String>>,
    pub(super) a_xyz: Option<Spanned<[Number; 3]>>,
    pub(super) a_rpy: Option<Spanned<[Angle; 3]>>,
    pub(super) b_xyz: Option<Spanned<[Number; 3]>>,
    pub(super) b_rpy: Option<Spanned<[Angle; 3]>>,
    pub(super) length: Option<Spanned<Number>>,
    pub(super) terms: Option<Spanned<BTreeMap<Spanned<String>, Number>>>,
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
    #[serde(default)]
    pub(super) elements: Vec<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Coupling {
    pub(super) motors: Vec<String>,
    pub(super) joints: Vec<String>,
    pub(super) matrix: Vec<Vec<Number>>,
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
