//! Journals, bearings and their contact.

use dynid::model::contact::{
    ContactLaw, FractalLankaraniNikravesh, FractalSettings, FractalSurface, HertzStiffness, JournalBearing,
    LankaraniNikravesh, Material, PressureFactor, SlidingFriction, SurfaceSettings,
};
use dynid::model::element::{ClearanceContact, JointElement};
use dynid::model::{EffortModel, RobotModel};
use dynid::sim::Plant;
use serde::Deserialize;

use super::pointing::description;
use super::tree::{NAMES, translations};
use super::{JOINTS, fault};
use crate::StudyError;

/// Both bearings are alike. SI units but for the roughness.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Bearing {
    pub(super) clearance: f64,
    pub(super) journal_radius: f64,
    pub(super) width: f64,
    pub(super) roughness_um: f64,
    pub(super) youngs_modulus: f64,
    pub(super) poisson_ratio: f64,
    pub(super) yield_strength: f64,
    pub(super) hardness_ratio: f64,
    pub(super) profile_constant: f64,
    pub(super) area_ratio: f64,
    pub(super) restitution: f64,
    pub(super) force_index: f64,
    pub(super) work_ratio_limit: f64,
    pub(super) impact_speed_floor: f64,
    pub(super) friction: f64,
    pub(super) v_0: f64,
    pub(super) v_m: f64,
    /// The unmodified law of smooth bodies in place of the fractal one.
    #[serde(default)]
    pub(super) smooth: bool,
}

impl Bearing {
    /// The fractal law for a link's mass.
    pub(super) fn fractal(
        &self,
        mass: f64,
        factor: PressureFactor,
    ) -> Result<FractalLankaraniNikravesh, StudyError> {
        let steel = self.material();
        let surface = FractalSurface::new(SurfaceSettings {
            roughness_um: self.roughness_um,
            friction: self.friction,
            softer: steel,
            harder: steel,
            yield_strength: self.yield_strength,
            hardness_ratio: self.hardness_ratio,
            pressure_factor: factor,
            profile_constant: self.profile_constant,
        })
        .map_err(fault)?;
        let settings = FractalSettings {
            mass,
            area_ratio: self.area_ratio,
            restitution: self.restitution,
            force_index: self.force_index,
            work_ratio_limit: self.work_ratio_limit,
            impact_speed_floor: self.impact_speed_floor,
        };
        FractalLankaraniNikravesh::new(surface, self.geometry()?, settings).map_err(fault)
    }

    fn material(&self) -> Material {
        Material { youngs_modulus: self.youngs_modulus, poisson_ratio: self.poisson_ratio }
    }

    fn geometry(&self) -> Result<JournalBearing, StudyError> {
        JournalBearing::with_gap(self.journal_radius, self.clearance, self.width).map_err(fault)
    }

    fn law(&self, mass: f64) -> Result<ContactLaw, StudyError> {
        if !self.smooth {
            return Ok(self.fractal(mass, PressureFactor::Poisson)?.into());
        }
        let steel = self.material();
        let stiffness = HertzStiffness::of_bearing(self.geometry()?, steel, steel).map_err(fault)?;
        Ok(LankaraniNikravesh::new(stiffness, self.restitution)
            .and_then(|law| law.with_impact_speed_floor(self.impact_speed_floor))
            .map_err(fault)?
            .into())
    }

    /// The contacts of both joints.
    pub(super) fn contacts(&self) -> Result<Vec<ClearanceContact>, StudyError> {
        let mechanism = description()?.build().map_err(fault)?;
        let friction = SlidingFriction::new(self.friction, self.v_0, self.v_m).map_err(fault)?;
        let contact = |joint: usize| {
            Ok(ClearanceContact {
                rotation: joint,
                translations: translations(joint),
                law: self.law(mechanism.bodies()[joint].inertia.mass())?,
                friction,
                journal_radius: self.journal_radius,
            })
        };
        (0..JOINTS).map(contact).collect()
    }

    /// The mechanism with clearance and contact in both joints.
    pub(super) fn plant(&self) -> Result<Plant, StudyError> {
        Self::plant_of(self.contacts()?)
    }

    /// The plant with contacts that may differ.
    pub(super) fn plant_of(contacts: Vec<ClearanceContact>) -> Result<Plant, StudyError> {
        let mechanism = description()?.with_clearance(&NAMES).map_err(fault)?.build().map_err(fault)?;
        let boxed = |contact| Box::new(contact) as Box<dyn JointElement>;
        let model = RobotModel::new(mechanism, contacts.into_iter().map(boxed).collect());
        let linear = model.parameters().prior();
        Plant::new(model, linear, Vec::new(), 1e-3).map_err(fault)
    }
}
