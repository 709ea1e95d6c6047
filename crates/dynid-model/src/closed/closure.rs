//! What closes a loop of a mechanism: joints that are cut, so that a tree remains.

use dynid_algebra::spatial::Placement;

/// A frame on a link, where a joint has been cut.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkFrame {
    /// Name of the link.
    pub link: String,
    /// The frame in that of the link.
    pub placement: Placement,
}

/// Kind of a cut joint between frame `a` (axes `x_a y_a z_a`, origin `P`) and frame `b` (`x_b y_b z_b`, `Q`), with
/// `d = Q - P`. Every kind is a list of residuals that are zero while the joint is closed, its *rows*.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CutKind {
    /// Both origins are one point: `x_a·d, y_a·d, z_a·d`.
    Spherical,
    /// Both origins are one point in the plane x y of `a`: `x_a·d, y_a·d`.
    PlanarRevolute,
    /// One point and one axis z: point; `x_a·z_b, y_a·z_b`.
    Revolute,
    /// One point, axis x of `a` at right angles to axis y of `b`: point; `x_a·y_b`.
    Universal,
    /// One axis z: `x_a·d, y_a·d, x_a·z_b, y_a·z_b`.
    Cylindrical,
    /// Sliding along z: `x_a·d, y_a·d, x_a·y_b, y_a·z_b, z_a·x_b`.
    Prismatic,
    /// Sliding along x in a plane: `y_a·d, x_a·y_b`.
    PlanarPrismatic,
    /// No motion: point; `x_a·y_b, y_a·z_b, z_a·x_b`.
    Fixed,
    /// A rod without mass between two ball joints: `(d·d - L²) / (2 L)`.
    Distance {
        /// Length `L` of the rod, m; positive.
        length: f64,
    },
}

impl CutKind {
    /// Number of rows.
    pub fn rows(self) -> usize {
        match self {
            CutKind::Spherical => 3,
            CutKind::PlanarRevolute | CutKind::PlanarPrismatic => 2,
            CutKind::Revolute | CutKind::Prismatic => 5,
            CutKind::Universal | CutKind::Cylindrical => 4,
            CutKind::Fixed => 6,
            CutKind::Distance { .. } => 1,
        }
    }

    /// The kind of a [name](CutKind::name); a rod has length 1.
    pub fn named(name: &str) -> Option<CutKind> {
        use CutKind::*;
        let all = [
            Spherical,
            PlanarRevolute,
            Revolute,
            Universal,
            Cylindrical,
            Prismatic,
            PlanarPrismatic,
            Fixed,
            Distance { length: 1.0 },
        ];
        all.into_iter().find(|kind| kind.name() == name)
    }

    /// The word that stands for it in robot files.
    pub fn name(self) -> &'static str {
        match self {
            CutKind::Spherical => "spherical",
            CutKind::PlanarRevolute => "planar_revolute",
            CutKind::Revolute => "revolute",
            CutKind::Universal => "universal",
            CutKind::Cylindrical => "cylindrical",
            CutKind::Prismatic => "prismatic",
            CutKind::PlanarPrismatic => "planar_prismatic",
            CutKind::Fixed => "fixed",
            CutKind::Distance { .. } => "distance",
        }
    }
}

/// What a closure demands.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a mechanism has few closures, nearly all of them joints")]
pub enum Condition {
    /// Two frames meet as in a joint.
    Joint {
        /// Kind.
        kind: CutKind,
        /// Frame on one link.
        a: LinkFrame,
        /// Frame on the other.
        b: LinkFrame,
    },
    /// Joints with one coordinate are coupled, `Σ factor · q = constant`: gears, parallel guides.
    Coordinates {
        /// Joint names and factors.
        terms: Vec<(String, f64)>,
        /// Right-hand side, in the unit of the terms.
        constant: f64,
    },
}

/// A closure as a robot file states it.
#[derive(Clone, Debug, PartialEq)]
pub struct ClosureDescription {
    /// Name, unique among closures.
    pub name: String,
    /// What it demands.
    pub condition: Condition,
}
