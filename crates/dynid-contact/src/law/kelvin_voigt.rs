//! Linear spring and damper.

use super::ContactForce;
use crate::error::{ContactError, checked};

/// `F = K δ + D δ'` in contact, with `D` at once at its full value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KelvinVoigt {
    stiffness: f64,
    damping: f64,
    clearance: f64,
}

impl KelvinVoigt {
    /// Stiffness `K`, N/m, above 0; damping `D`, N s/m, at least 0; radial clearance, m, above 0. Fails otherwise.
    pub fn new(stiffness: f64, damping: f64, clearance: f64) -> Result<Self, ContactError> {
        checked("stiffness", "above 0 N/m", stiffness, stiffness > 0.0)?;
        checked("damping", "at least 0 N s/m", damping, damping >= 0.0)?;
        checked("clearance", "above 0 m", clearance, clearance > 0.0)?;
        Ok(KelvinVoigt { stiffness, damping, clearance })
    }

    /// `K`, N/m.
    pub fn stiffness(&self) -> f64 {
        self.stiffness
    }

    /// `D`, N s/m.
    pub fn damping(&self) -> f64 {
        self.damping
    }

    pub(super) fn clearance(&self) -> f64 {
        self.clearance
    }

    pub(super) fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        Self::new(self.stiffness, self.damping, clearance)
    }

    pub(super) fn at(&self, penetration: f64) -> ContactForce {
        ContactForce {
            elastic: self.stiffness * penetration,
            damping: self.damping,
            elastic_slope: self.stiffness,
            ..ContactForce::default()
        }
    }

    pub(super) fn stored_energy(&self, penetration: f64) -> f64 {
        0.5 * self.stiffness * penetration * penetration
    }
}
