//! Limits, how far they are used, and obstacles.

use serde::Serialize;

/// A limit and its largest use.
///
/// Limits whose `subject` is the name of a joint stand in one table of joints and kinds, others in a list.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LimitUse {
    /// What is limited, e.g. `velocity`, `effort`, `distance from a plane`.
    pub kind: String,
    /// Whose: joint, frame or pair of bodies.
    pub subject: String,
    /// Largest use, %: 100 at the limit. For a position range, distance from its middle over half the range. `None` where
    /// a share has no meaning, as for distances.
    pub use_percent: Option<f64>,
    /// Least distance from the limit, negative where it is broken.
    pub margin: Option<f64>,
    /// Unit of `margin`.
    pub margin_unit: String,
    /// Instant of the largest use, s after the start of the period.
    pub at_s: Option<f64>,
    /// The limit acts: without it another trajectory would be better.
    pub acts: bool,
}

/// What the path of a frame keeps away from, or stays within.
#[derive(Clone, Debug, Serialize)]
pub struct Obstacle {
    /// Name, e.g. `floor`; may be empty.
    pub name: String,
    /// Names of the frames it holds for; empty: all.
    pub frames: Vec<String>,
    /// Where it is.
    pub shape: Shape,
}

/// Shape of an obstacle, in base axes (`z` upwards), m.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Shape {
    /// Allowed where `n·x ≥ offset`, `n = normal / |normal|`.
    HalfSpace {
        /// Direction into the allowed side; any length but zero.
        normal: [f64; 3],
        /// Distance of the plane from the origin along the normal, m.
        offset_m: f64,
    },
    /// Allowed inside an upright box.
    InsideBox {
        /// Smallest coordinates, m.
        lower_m: [f64; 3],
        /// Largest coordinates, m.
        upper_m: [f64; 3],
    },
    /// Allowed outside an upright box.
    OutsideBox {
        /// Smallest coordinates, m.
        lower_m: [f64; 3],
        /// Largest coordinates, m.
        upper_m: [f64; 3],
    },
    /// Allowed outside an upright cylinder without ends.
    OutsideCylinder {
        /// `x`, `y` of the axis, m.
        center_m: [f64; 2],
        /// Radius, m.
        radius_m: f64,
    },
    /// Allowed outside an upright column or above it.
    OutsideOrAboveColumn {
        /// `x`, `y` of the axis, m.
        center_m: [f64; 2],
        /// Radius, m.
        radius_m: f64,
        /// `z` of the top, m.
        height_m: f64,
    },
}
