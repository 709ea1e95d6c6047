//! Contact of rough surfaces.

mod curve;
mod energy;

use super::ContactForce;
use super::hertz::hysteresis;
use crate::bearing::JournalBearing;
use crate::error::{ContactError, checked};
use crate::surface::FractalSurface;
use crate::validity::SpotValidity;
use curve::SpotCurve;

/// What a rough contact needs beside surface and bearing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FractalSettings {
    /// Mass `M` in the damping, kg, above 0: that of the link which carries the journal.
    pub mass: f64,
    /// Share `λ` of the nominal area of contact that touches, in (0, 1); default 0.01.
    pub area_ratio: f64,
    /// Coefficient of restitution `c_e`, in (0, 1]; default 0.9.
    pub restitution: f64,
    /// Exponent `n` of the penetration, in [1, 2]; default 1.5 as in Lankarani & Nikravesh, `K_m` then being read in N/m^n.
    /// With 1 the units hold, and the contact is some hundred times stiffer.
    pub force_index: f64,
    /// Upper limit `η_max` of plastic over elastic work, above 0; default 1. Small spots have no elastic work at all.
    pub work_ratio_limit: f64,
    /// Least speed of impact, m/s, above 0; default 0.01. Without it a contact closed at rest would be rigid.
    pub impact_speed_floor: f64,
}

impl FractalSettings {
    /// The defaults, for a mass.
    pub fn new(mass: f64) -> Self {
        FractalSettings {
            mass,
            area_ratio: 0.01,
            restitution: 0.9,
            force_index: 1.5,
            work_ratio_limit: 1.0,
            impact_speed_floor: super::ContactLaw::IMPACT_SPEED_FLOOR,
        }
    }

    fn check(&self) -> Result<(), ContactError> {
        let s = self;
        checked("mass", "above 0 kg", s.mass, s.mass > 0.0)?;
        checked("area_ratio", "in (0, 1)", s.area_ratio, s.area_ratio > 0.0 && s.area_ratio < 1.0)?;
        checked("restitution", "in (0, 1]", s.restitution, s.restitution > 0.0 && s.restitution <= 1.0)?;
        checked("force_index", "in [1, 2]", s.force_index, (1.0..=2.0).contains(&s.force_index))?;
        checked("work_ratio_limit", "above 0", s.work_ratio_limit, s.work_ratio_limit > 0.0)?;
        checked("impact_speed_floor", "above 0 m/s", s.impact_speed_floor, s.impact_speed_floor > 0.0)?;
        Ok(())
    }
}

/// Rough contact: `F = K_m(δ) δ^n + (D_n + C_n) δ'`.
///
/// `K_m` sums the stiffness of the asperities whose areas go up to `a_l = m A_r(δ)`; `D_n = 3 K_m (1 - c_e²) δ^n/(4 v0)`
/// is the hysteresis of Lankarani & Nikravesh; `C_n = η √(M K_m)` with `η = min(W_p/W_e, η_max)`, the plastic over the elastic
/// work of the asperities. `C_n` goes as `√K_m`, so the force jumps at an impact.
///
/// Integrals end at `a_l`. Spots below `a_2` add no stiffness, so that there is no force until `a_l` exceeds it. For steel
/// in a bearing of 10 mm with 50 µm of clearance this is at 5 fm with `Ra = 0.8` µm and at 60 nm with 10 µm; with 25 µm it
/// is never, and such a contact is refused.
///
/// Source: Sun, Han, Li & Li, *Robotics* 2021, 10(1), 36.
#[derive(Debug, Clone, PartialEq)]
pub struct FractalLankaraniNikravesh {
    surface: FractalSurface,
    bearing: JournalBearing,
    settings: FractalSettings,
    curve: SpotCurve,
}

/// Everything in between, at a penetration.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FractalContact {
    /// Real area of contact `A_r`, m².
    pub real_area: f64,
    /// Largest spot `a_l = m A_r`, m².
    pub largest_spot: f64,
    /// `K_m`, N/m (N/m^n).
    pub stiffness: f64,
    /// Elastic work `W_e`, J.
    pub elastic_work: f64,
    /// Plastic work `W_p`, J.
    pub plastic_work: f64,
    /// `η = W_p/W_e`, not above its limit.
    pub work_ratio: f64,
    /// `C_n = η √(M K_m)`, N s/m.
    pub asperity_damping: f64,
    /// `D_n`, N s/m.
    pub hysteresis_damping: f64,
}

/// Value and derivative by `u = ln(a_l/a_c)`.
#[derive(Debug, Clone, Copy)]
struct Curved {
    value: f64,
    slope: f64,
}

impl FractalLankaraniNikravesh {
    /// Fails if a setting is outside its range, and if no penetration brings the largest spot beyond the plastic limit `a_2`.
    pub fn new(
        surface: FractalSurface,
        bearing: JournalBearing,
        settings: FractalSettings,
    ) -> Result<Self, ContactError> {
        settings.check()?;
        let curve = SpotCurve::new(&surface, &bearing, &settings)?;
        Ok(FractalLankaraniNikravesh { surface, bearing, settings, curve })
    }

    /// Surface.
    pub fn surface(&self) -> &FractalSurface {
        &self.surface
    }

    /// Geometry.
    pub fn bearing(&self) -> &JournalBearing {
        &self.bearing
    }

    /// Settings.
    pub fn settings(&self) -> &FractalSettings {
        &self.settings
    }

    /// Penetrations, m, at which `a_l` passes `a_2`, `a_1` and `a_c`; infinite for limits that it never reaches.
    pub fn stage_penetrations(&self) -> [f64; 3] {
        self.curve.penetrations
    }

    /// All intermediate numbers at a penetration, m, of a contact that closed at `impact_speed`, m/s.
    pub fn state(&self, penetration: f64, impact_speed: f64) -> FractalContact {
        let real_area = self.bearing.real_area(penetration, self.settings.area_ratio);
        let largest_spot = self.surface.constants().largest_share * real_area;
        let u = self.curve.spot(penetration);
        let (stiffness, work_ratio) = (self.curve.stiffness(u).value, self.curve.work_ratio(u).value);
        let [elastic_work, plastic_work] = self.curve.works(u);
        let elastic = stiffness * self.power(penetration.max(0.0)).0;
        FractalContact {
            real_area,
            largest_spot,
            stiffness,
            elastic_work,
            plastic_work,
            work_ratio,
            asperity_damping: work_ratio * (self.settings.mass * stiffness).sqrt(),
            hysteresis_damping: elastic * self.loss(impact_speed),
        }
    }

    pub(super) fn with_clearance(&self, clearance: f64) -> Result<Self, ContactError> {
        Self::new(self.surface, self.bearing.with_clearance(clearance)?, self.settings)
    }

    pub(super) fn at(&self, penetration: f64, impact_speed: f64) -> ContactForce {
        let u = self.curve.spot(penetration);
        let k = self.curve.stiffness(u);
        if k.value <= 0.0 {
            return ContactForce::default();
        }
        let eta = self.curve.work_ratio(u);
        let (power, power_slope) = self.power(penetration);
        let gap = 0.5 / (self.bearing.clearance() + penetration);
        let u_by_penetration = gap * self.bearing.clearance() / penetration;
        let elastic = k.value * power;
        let elastic_by_u = k.slope * power;
        let loss = self.loss(impact_speed);
        let root = (self.settings.mass * k.value).sqrt();
        let damping_by_u = root * (eta.slope + 0.5 * eta.value * k.slope / k.value);
        let elastic_slope = elastic_by_u * u_by_penetration + k.value * power_slope;
        ContactForce {
            elastic,
            damping: loss * elastic + eta.value * root,
            elastic_slope,
            damping_slope: loss * elastic_slope + damping_by_u * u_by_penetration,
            elastic_by_clearance: -gap * elastic_by_u,
            damping_by_clearance: -gap * (loss * elastic_by_u + damping_by_u),
        }
    }

    pub(super) fn spot_validity(&self, penetration: f64) -> SpotValidity {
        let u = self.curve.spot(penetration);
        SpotValidity {
            largest_over_critical: u.exp(),
            elastic: u > 0.0,
            first_elastoplastic: u > self.curve.first,
            second_elastoplastic: u > self.curve.second,
            work_ratio_capped: self.curve.work_ratio(u).value >= self.settings.work_ratio_limit,
        }
    }

    /// `3 (1 - c_e²)/(4 v0)`.
    fn loss(&self, impact_speed: f64) -> f64 {
        hysteresis(self.settings.restitution, impact_speed.max(self.settings.impact_speed_floor))
    }

    /// `δ^n` and its slope.
    fn power(&self, penetration: f64) -> (f64, f64) {
        let n = self.settings.force_index;
        let below = if n == 1.5 {
            penetration.sqrt()
        } else if n == 1.0 {
            1.0
        } else {
            penetration.powf(n - 1.0)
        };
        (below * penetration, n * below)
    }
}
