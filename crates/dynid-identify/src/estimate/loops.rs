//! Loops of a mechanism in the result file.

use dynid_model::closed::{ClosedMechanism, ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{Mat3, Mechanism, Placement, Vec3};
use serde::{Deserialize, Serialize};

/// Cut joints, and what chooses among the poses of a closed mechanism.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct LoopsRecord {
    /// Cut joints.
    pub closures: Vec<ClosureRecord>,
    /// Driven joints.
    pub driven: Vec<String>,
    /// Closed pose that others are sought from: positions by joint.
    pub home: Vec<(String, Vec<f64>)>,
}

dynid_record::words! {
    /// Kind of a closure, as in robot files.
    ClosureKind {
        /// A ball joint.
        Spherical = "spherical",
        /// A pivot in a plane.
        PlanarRevolute = "planar_revolute",
        /// A pivot.
        Revolute = "revolute",
        /// Two crossed pivots.
        Universal = "universal",
        /// Rotation about an axis and translation along it.
        Cylindrical = "cylindrical",
        /// A slide.
        Prismatic = "prismatic",
        /// A slide in a plane.
        PlanarPrismatic = "planar_prismatic",
        /// No motion.
        Fixed = "fixed",
        /// A rod between two points.
        Distance = "distance",
        /// Coordinates of joints that are coupled.
        Coordinate = "coordinate",
    }
}

impl From<&Condition> for ClosureKind {
    fn from(condition: &Condition) -> Self {
        let Condition::Joint { kind, .. } = condition else { return ClosureKind::Coordinate };
        match kind {
            CutKind::Spherical => ClosureKind::Spherical,
            CutKind::PlanarRevolute => ClosureKind::PlanarRevolute,
            CutKind::Revolute => ClosureKind::Revolute,
            CutKind::Universal => ClosureKind::Universal,
            CutKind::Cylindrical => ClosureKind::Cylindrical,
            CutKind::Prismatic => ClosureKind::Prismatic,
            CutKind::PlanarPrismatic => ClosureKind::PlanarPrismatic,
            CutKind::Fixed => ClosureKind::Fixed,
            CutKind::Distance { .. } => ClosureKind::Distance,
        }
    }
}

/// A cut joint, or a coupling of coordinates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ClosureRecord {
    /// Name.
    pub name: String,
    /// Kind, as in robot files.
    pub kind: ClosureKind,
    /// Frames on both links; absent for a coupling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<[FrameRecord; 2]>,
    /// Length of a rod, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Coupled joints and their factors.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub terms: Vec<(String, f64)>,
    /// What the terms sum to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub constant: Option<f64>,
}

/// A frame on a link.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FrameRecord {
    /// Link.
    pub link: String,
    /// Rows of the rotation link ← frame.
    pub rotation: [[f64; 3]; 3],
    /// Origin in the link, m.
    pub translation: [f64; 3],
}

impl LoopsRecord {
    pub(super) fn new(closed: &ClosedMechanism) -> Self {
        LoopsRecord {
            closures: closed.closures().iter().map(ClosureRecord::new).collect(),
            driven: closed.driven_names(),
            home: closed.home_by_joint(),
        }
    }

    /// The closures as a robot file states them.
    pub(super) fn descriptions(&self) -> Result<Vec<ClosureDescription>, String> {
        self.closures.iter().map(ClosureRecord::description).collect()
    }

    /// Closes the loops again.
    pub(super) fn close(&self, mechanism: &Mechanism) -> Result<ClosedMechanism, String> {
        ClosedMechanism::new(mechanism.clone(), self.descriptions()?, Some(&self.driven), &self.home)
            .map_err(|e| e.to_string())
    }
}

impl ClosureRecord {
    fn new(closure: &ClosureDescription) -> Self {
        let (name, kind) = (closure.name.clone(), ClosureKind::from(&closure.condition));
        match &closure.condition {
            Condition::Joint { kind: cut, a, b } => ClosureRecord {
                name,
                kind,
                frames: Some([a, b].map(FrameRecord::new)),
                length: match cut {
                    CutKind::Distance { length } => Some(*length),
                    _ => None,
                },
                terms: Vec::new(),
                constant: None,
            },
            Condition::Coordinates { terms, constant } => ClosureRecord {
                name,
                kind,
                frames: None,
                length: None,
                terms: terms.clone(),
                constant: Some(*constant),
            },
        }
    }

    fn description(&self) -> Result<ClosureDescription, String> {
        let name = self.name.clone();
        let cut = match (self.kind, self.length) {
            (ClosureKind::Coordinate, _) => {
                let constant = self.constant.unwrap_or(0.0);
                let condition = Condition::Coordinates { terms: self.terms.clone(), constant };
                return Ok(ClosureDescription { name, condition });
            }
            (ClosureKind::Distance, Some(length)) => CutKind::Distance { length },
            (ClosureKind::Distance, None) => return Err(format!("loop `{name}`: no length")),
            (ClosureKind::Spherical, _) => CutKind::Spherical,
            (ClosureKind::PlanarRevolute, _) => CutKind::PlanarRevolute,
            (ClosureKind::Revolute, _) => CutKind::Revolute,
            (ClosureKind::Universal, _) => CutKind::Universal,
            (ClosureKind::Cylindrical, _) => CutKind::Cylindrical,
            (ClosureKind::Prismatic, _) => CutKind::Prismatic,
            (ClosureKind::PlanarPrismatic, _) => CutKind::PlanarPrismatic,
            (ClosureKind::Fixed, _) => CutKind::Fixed,
        };
        let Some([a, b]) = &self.frames else { return Err(format!("loop `{name}`: no frames")) };
        let condition = Condition::Joint { kind: cut, a: a.frame(), b: b.frame() };
        Ok(ClosureDescription { name, condition })
    }
}

impl FrameRecord {
    fn new(frame: &LinkFrame) -> Self {
        FrameRecord {
            link: frame.link.clone(),
            rotation: frame.placement.rotation.rows(),
            translation: frame.placement.translation.0,
        }
    }

    fn frame(&self) -> LinkFrame {
        let (rotation, translation) = (Mat3::from_rows(self.rotation), Vec3(self.translation));
        LinkFrame { link: self.link.clone(), placement: Placement { rotation, translation } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kinds_of_cuts_have_the_words_of_robot_files() {
        let at = || LinkFrame { link: String::new(), placement: Placement::identity() };
        for word in ClosureKind::ALL.iter().filter(|kind| **kind != ClosureKind::Coordinate) {
            let kind = CutKind::named(word.word()).unwrap();
            assert_eq!(ClosureKind::from(&Condition::Joint { kind, a: at(), b: at() }), *word);
        }
    }
}
