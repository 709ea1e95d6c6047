//! Contacts of smooth bodies, `K δ^1.5`, without and with damping.

use super::{ContactForce, ContactLaw};
use crate::bearing::JournalBearing;
use crate::error::{ContactError, checked};
use crate::material::Material;

/// Stiffness of a smooth contact with the force `K δ^1.5`, and the clearance it holds for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzStiffness {
    coefficient: f64,
    by_clearance: f64,
    clearance: f64,
    bodies: Option<Bodies>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Bodies {
    combined_modulus: f64,
    bearing: JournalBearing,
}

impl HertzStiffness {
    /// A given `K`, N/m^1.5, whatever the clearance, m. Fails unless both are above 0.
    pub fn given(coefficient: f64, clearance: f64) -> Result<Self, ContactError> {
        checked("stiffness", "above 0 N/m^1.5", coefficient, coefficient > 0.0)?;
        checked("clearance", "above 0 m", clearance, clearance > 0.0)?;
        Ok(HertzStiffness { coefficient, by_clearance: 0.0, clearance, bodies: None })
    }

    /// `K = 4/3 E* √(R1 R2/(R1 - R2))` of a journal in its bearing.
    ///
    /// Hertz takes both for spheres that differ in curvature, so for narrow clearances this is an order of magnitude only.
    /// Fails as [`Material::compliance`] does.
    pub fn of_bearing(
        bearing: JournalBearing,
        journal: Material,
        bushing: Material,
    ) -> Result<Self, ContactError> {
        Ok(Self::of_bodies(Bodies { combined_modulus: journal.combined_modulus(&bushing)?, bearing }))
    }

    fn of_bodies(bodies: Bodies) -> Self {
        let Bodies { combined_modulus, bearing } = bodies;
        let (outer, clearance) = (bearing.bearing_radius(), bearing.clearance());
        let coefficient =
            4.0 / 3.0 * combined_modulus * (outer * bearing.journal_radius() / clearance).sqrt();
        let by_clearance = 0.5 * coefficient * (1.0 / outer - 1.0 / clearance);
        HertzStiffness { coefficient, by_clearance, clearance, bodies: Some(bodies) }
    }

    /// `K`, N/m^1.5.
    pub fn coefficient(&self) -> f64 {
        self.coefficient
    }

    /// Radial clearance, m.
    pub fn clearance(&self) -> f64 {
        self.clearance
    }

    fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        match self.bodies {
            Some(Bodies { combined_modulus, bearing }) => {
                Ok(Self::of_bodies(Bodies { combined_modulus, bearing: bearing.with_clearance(clearance)? }))
            }
            None => Self::given(self.coefficient, clearance),
        }
    }

    pub(super) fn elastic(&self, penetration: f64) -> ContactForce {
        let root = penetration.sqrt();
        let power = penetration * root;
        ContactForce {
            elastic: self.coefficient * power,
            elastic_slope: 1.5 * self.coefficient * root,
            elastic_by_clearance: self.by_clearance * power,
            ..ContactForce::default()
        }
    }

    pub(super) fn stored_energy(&self, penetration: f64) -> f64 {
        0.4 * self.coefficient * penetration * penetration * penetration.sqrt()
    }

    pub(super) fn static_penetration(&self, load: f64) -> f64 {
        (load / self.coefficient).powf(2.0 / 3.0)
    }
}

/// `F = K δ^1.5`, no energy lost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hertz {
    stiffness: HertzStiffness,
}

impl Hertz {
    /// Of a checked stiffness.
    pub fn new(stiffness: HertzStiffness) -> Self {
        Hertz { stiffness }
    }

    /// `K` and clearance.
    pub fn stiffness(&self) -> &HertzStiffness {
        &self.stiffness
    }

    pub(super) fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        Ok(Hertz { stiffness: self.stiffness.with_clearance(clearance)? })
    }
}

/// `F = K δ^1.5 [1 + 3 (1 - c_e²) δ'/(4 v0)]`.
///
/// Two free bodies part with a share of their speed that is `c_e` only near 1: 0.913, 0.796, 0.725 for `c_e` = 0.9, 0.7,
/// 0.5.
///
/// Source: Lankarani & Nikravesh, *A contact force model with hysteresis damping for impact analysis of multibody systems*,
/// J. Mech. Design 112 (1990).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LankaraniNikravesh {
    stiffness: HertzStiffness,
    restitution: f64,
    impact_speed_floor: f64,
}

impl LankaraniNikravesh {
    /// Of a checked stiffness and a coefficient of restitution `c_e` in (0, 1], with the least speed of impact
    /// [`ContactLaw::IMPACT_SPEED_FLOOR`]. Fails if `c_e` is outside.
    pub fn new(stiffness: HertzStiffness, restitution: f64) -> Result<Self, ContactError> {
        checked("restitution", "in (0, 1]", restitution, restitution > 0.0 && restitution <= 1.0)?;
        let impact_speed_floor = ContactLaw::IMPACT_SPEED_FLOOR;
        Ok(LankaraniNikravesh { stiffness, restitution, impact_speed_floor })
    }

    /// With another least speed of impact, m/s. Fails unless it is above 0.
    pub fn with_impact_speed_floor(self, speed: f64) -> Result<Self, ContactError> {
        let impact_speed_floor = checked("impact_speed_floor", "above 0 m/s", speed, speed > 0.0)?;
        Ok(LankaraniNikravesh { impact_speed_floor, ..self })
    }

    /// `K` and clearance.
    pub fn stiffness(&self) -> &HertzStiffness {
        &self.stiffness
    }

    /// `c_e`.
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// Least speed of impact, m/s.
    pub fn impact_speed_floor(&self) -> f64 {
        self.impact_speed_floor
    }

    pub(super) fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        Ok(LankaraniNikravesh { stiffness: self.stiffness.with_clearance(clearance)?, ..*self })
    }

    pub(super) fn at(&self, penetration: f64, impact_speed: f64) -> ContactForce {
        let force = self.stiffness.elastic(penetration);
        let loss = hysteresis(self.restitution, impact_speed.max(self.impact_speed_floor));
        ContactForce {
            damping: loss * force.elastic,
            damping_slope: loss * force.elastic_slope,
            damping_by_clearance: loss * force.elastic_by_clearance,
            ..force
        }
    }
}

/// `3 (1 - c_e²)/(4 v0)`, s/m.
pub(super) fn hysteresis(restitution: f64, impact_speed: f64) -> f64 {
    0.75 * (1.0 - restitution * restitution) / impact_speed
}
