//! What can be wrong with the numbers of a contact.

use crate::roughness::roughness_of_dimension;

/// A number from which no contact law can be made.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// A number is outside its range, or not finite.
    #[error("`{field}`: expected {expected}, found {found}")]
    OutOfRange {
        /// Field as it is named in the settings.
        field: &'static str,
        /// Range with unit.
        expected: &'static str,
        /// The number.
        found: f64,
    },
    /// The roughness gives no fractal dimension of a surface.
    #[error(
        "`roughness_um`: expected a fractal dimension in (2, 3), that is Ra in ({:.2e}, {:.2e}) µm, found D = {dimension} \
         from Ra = {roughness_um} µm",
        roughness_of_dimension(3.0),
        roughness_of_dimension(2.0)
    )]
    FractalDimension {
        /// Ra, µm.
        roughness_um: f64,
        /// `D` of that roughness.
        dimension: f64,
    },
    /// A constant of the surface leaves the range of numbers, as for `D` next to 2.
    #[error(
        "`roughness_um`: expected a surface whose {constant} is a positive number, found {found} at D = {dimension}"
    )]
    SurfaceConstant {
        /// The constant, with its symbol.
        constant: &'static str,
        /// What was computed.
        found: f64,
        /// `D` of the surface.
        dimension: f64,
    },
    /// Even the largest contact spot that the bearing can form is fully plastic: the law would have no stiffness.
    #[error(
        "`area_ratio`: expected contact spots that can grow beyond the plastic limit a_2 = {limit:.3e} m², found at most \
         {largest:.3e} m²: the surface is too rough for so small a share"
    )]
    AllPlastic {
        /// Largest spot at any penetration, m².
        largest: f64,
        /// `a_2`, m².
        limit: f64,
    },
}

impl ContactError {
    /// Name of the field to change.
    pub fn field(&self) -> &'static str {
        match self {
            ContactError::OutOfRange { field, .. } => field,
            ContactError::FractalDimension { .. } | ContactError::SurfaceConstant { .. } => "roughness_um",
            ContactError::AllPlastic { .. } => "area_ratio",
        }
    }
}

/// The number itself if it is finite and `accepted`.
pub(super) fn checked(
    field: &'static str,
    expected: &'static str,
    found: f64,
    accepted: bool,
) -> Result<f64, ContactError> {
    if found.is_finite() && accepted {
        Ok(found)
    } else {
        Err(ContactError::OutOfRange { field, expected, found })
    }
}
