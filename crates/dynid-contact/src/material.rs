//! Elastic constants of the two bodies.

use crate::error::{ContactError, checked};

/// Elastic constants of an isotropic body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Material {
    /// Young's modulus `E`, Pa, above 0.
    pub youngs_modulus: f64,
    /// Poisson's ratio `ν`, in (-1, 0.5].
    pub poisson_ratio: f64,
}

impl Material {
    /// Steel: 207 GPa, 0.3.
    pub const STEEL: Material = Material { youngs_modulus: 207e9, poisson_ratio: 0.3 };

    /// `(1 - ν²)/E`, 1/Pa.
    ///
    /// Fails if the modulus is not above 0 or Poisson's ratio is outside (-1, 0.5].
    pub fn compliance(&self) -> Result<f64, ContactError> {
        let modulus =
            checked("youngs_modulus", "above 0 Pa", self.youngs_modulus, self.youngs_modulus > 0.0)?;
        let ratio = self.poisson_ratio;
        let ratio = checked("poisson_ratio", "in (-1, 0.5]", ratio, ratio > -1.0 && ratio <= 0.5)?;
        Ok((1.0 - ratio * ratio) / modulus)
    }

    /// Combined modulus of two bodies in contact, `1/E* = (1 - ν1²)/E1 + (1 - ν2²)/E2`, Pa.
    ///
    /// Fails as [`Material::compliance`] does.
    pub fn combined_modulus(&self, other: &Material) -> Result<f64, ContactError> {
        Ok(1.0 / (self.compliance()? + other.compliance()?))
    }
}
