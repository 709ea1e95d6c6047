//! The normal force as a function of penetration.

mod fractal;
mod hertz;
mod kelvin_voigt;

pub use fractal::{FractalContact, FractalLankaraniNikravesh, FractalSettings};
pub use hertz::{Hertz, HertzStiffness, LankaraniNikravesh};
pub use kelvin_voigt::KelvinVoigt;

use crate::error::ContactError;
use crate::validity::ContactValidity;

/// At a penetration: what the normal force is made of and how it changes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ContactForce {
    /// Elastic part, N.
    pub elastic: f64,
    /// Damping coefficient, N s/m: the force is `max(0, elastic + damping * rate)`.
    pub damping: f64,
    /// d elastic / d penetration at constant clearance, N/m.
    pub elastic_slope: f64,
    /// d damping / d penetration at constant clearance.
    pub damping_slope: f64,
    /// d elastic / d clearance at constant penetration, N/m.
    pub elastic_by_clearance: f64,
    /// d damping / d clearance at constant penetration.
    pub damping_by_clearance: f64,
}

impl ContactForce {
    /// Normal force `max(0, elastic + damping δ')` at a rate of penetration `δ'`, m/s: a contact never pulls.
    #[inline]
    pub fn normal_force(&self, rate: f64) -> f64 {
        (self.elastic + self.damping * rate).max(0.0)
    }
}

/// A law of normal contact between journal and bearing: `F_n = max(0, elastic(δ) + damping(δ; v0) δ')`.
#[derive(Debug, Clone, PartialEq)]
pub enum ContactLaw {
    /// Rough surfaces, stiffness and damping from their asperities.
    Fractal(Box<FractalLankaraniNikravesh>),
    /// Smooth surfaces, damping from a coefficient of restitution.
    LankaraniNikravesh(LankaraniNikravesh),
    /// Smooth surfaces, no damping.
    Hertz(Hertz),
    /// Linear spring and damper.
    KelvinVoigt(KelvinVoigt),
}

impl From<FractalLankaraniNikravesh> for ContactLaw {
    fn from(law: FractalLankaraniNikravesh) -> Self {
        ContactLaw::Fractal(Box::new(law))
    }
}

impl From<LankaraniNikravesh> for ContactLaw {
    fn from(law: LankaraniNikravesh) -> Self {
        ContactLaw::LankaraniNikravesh(law)
    }
}

impl From<Hertz> for ContactLaw {
    fn from(law: Hertz) -> Self {
        ContactLaw::Hertz(law)
    }
}

impl From<KelvinVoigt> for ContactLaw {
    fn from(law: KelvinVoigt) -> Self {
        ContactLaw::KelvinVoigt(law)
    }
}

impl ContactLaw {
    /// Radial clearance, m, above 0.
    #[inline]
    pub fn clearance(&self) -> f64 {
        match self {
            ContactLaw::Fractal(law) => law.bearing().clearance(),
            ContactLaw::LankaraniNikravesh(law) => law.stiffness().clearance(),
            ContactLaw::Hertz(law) => law.stiffness().clearance(),
            ContactLaw::KelvinVoigt(law) => law.clearance(),
        }
    }

    /// Returns the law, surfaces and journal with another clearance, m.
    ///
    /// Fails unless it is above 0, and as [`FractalLankaraniNikravesh::new`] does if it leaves only plastic spots.
    pub fn with_clearance(&self, clearance: f64) -> Result<ContactLaw, ContactError> {
        Ok(match self {
            ContactLaw::Fractal(law) => law.with_clearance(clearance)?.into(),
            ContactLaw::LankaraniNikravesh(law) => law.with_clearance(clearance)?.into(),
            ContactLaw::Hertz(law) => law.with_clearance(clearance)?.into(),
            ContactLaw::KelvinVoigt(law) => law.with_clearance(clearance)?.into(),
        })
    }

    /// Least speed of impact that the damping takes, m/s: without it, a contact closed at rest would be rigid.
    ///
    /// Laws whose damping knows no speed of impact give [`ContactLaw::IMPACT_SPEED_FLOOR`].
    #[inline]
    pub fn impact_speed_floor(&self) -> f64 {
        match self {
            ContactLaw::Fractal(law) => law.settings().impact_speed_floor,
            ContactLaw::LankaraniNikravesh(law) => law.impact_speed_floor(),
            ContactLaw::Hertz(_) | ContactLaw::KelvinVoigt(_) => Self::IMPACT_SPEED_FLOOR,
        }
    }

    /// Default of the least speed of impact, m/s.
    pub const IMPACT_SPEED_FLOOR: f64 = 0.01;

    /// Force at a penetration, m, of a contact that closed at `impact_speed`, m/s (raised to the floor).
    ///
    /// All zero unless the penetration is above 0. Where a slope jumps, at the limits of the stages, it is that of one side.
    #[inline]
    pub fn at(&self, penetration: f64, impact_speed: f64) -> ContactForce {
        if penetration <= 0.0 || penetration.is_nan() {
            return ContactForce::default();
        }
        match self {
            ContactLaw::Fractal(law) => law.at(penetration, impact_speed),
            ContactLaw::LankaraniNikravesh(law) => law.at(penetration, impact_speed),
            ContactLaw::Hertz(law) => law.stiffness().elastic(penetration),
            ContactLaw::KelvinVoigt(law) => law.at(penetration),
        }
    }

    /// Energy `∫ elastic dδ` from 0 to a penetration, J; 0 unless that is above 0. Relative error below 1e-11.
    pub fn stored_energy(&self, penetration: f64) -> f64 {
        if penetration <= 0.0 || penetration.is_nan() {
            return 0.0;
        }
        match self {
            ContactLaw::Fractal(law) => law.stored_energy(penetration),
            ContactLaw::LankaraniNikravesh(law) => law.stiffness().stored_energy(penetration),
            ContactLaw::Hertz(law) => law.stiffness().stored_energy(penetration),
            ContactLaw::KelvinVoigt(law) => law.stored_energy(penetration),
        }
    }

    /// Penetration at rest under a load, N: `elastic(δ) = load`, to rounding; 0 unless the load is above 0.
    pub fn static_penetration(&self, load: f64) -> f64 {
        if !(load > 0.0 && load.is_finite()) {
            return if load > 0.0 { load } else { 0.0 };
        }
        match self {
            ContactLaw::Fractal(law) => law.static_penetration(load),
            ContactLaw::LankaraniNikravesh(law) => law.stiffness().static_penetration(load),
            ContactLaw::Hertz(law) => law.stiffness().static_penetration(load),
            ContactLaw::KelvinVoigt(law) => load / law.stiffness(),
        }
    }

    /// Whether the law is used inside the range it was made for.
    pub fn validity(&self, penetration: f64) -> ContactValidity {
        let depth = penetration.max(0.0);
        ContactValidity {
            penetration_over_clearance: depth / self.clearance(),
            spots: match self {
                ContactLaw::Fractal(law) => Some(law.spot_validity(depth)),
                _ => None,
            },
        }
    }
}
