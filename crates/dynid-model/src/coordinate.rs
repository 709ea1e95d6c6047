//! Coordinates that no body moves with.

use crate::description::Limits;

/// A coordinate of a model besides those of its mechanism: the angle of a motor behind an elastic transmission, or a link
/// whose load is measured instead of modelled.
///
/// No rigid body feels it. What acts on it are elements: a [`RotorInertia`](crate::element::RotorInertia), friction, one
/// end of an [`ElasticTransmission`](crate::element::ElasticTransmission).
#[derive(Debug, Clone, PartialEq)]
pub struct Coordinate {
    /// Name, other than those of all joints and coordinates.
    pub name: String,
    /// Whether the coordinate slides (m, N) instead of turning (rad, N m).
    pub slides: bool,
    /// Limits.
    pub limits: Limits,
}

impl Coordinate {
    /// A coordinate that turns.
    pub fn turning(name: impl Into<String>) -> Self {
        Coordinate { name: name.into(), slides: false, limits: Limits::default() }
    }

    /// A coordinate that slides.
    pub fn sliding(name: impl Into<String>) -> Self {
        Coordinate { name: name.into(), slides: true, limits: Limits::default() }
    }

    /// Unit of its effort.
    pub fn effort_unit(&self) -> &'static str {
        if self.slides { "N" } else { "N m" }
    }
}
