//! What joints with clearance do at rest.

use dynid_model::contact::ContactLaw;
use dynid_model::{EffortModel, RobotModel};
use dynid_sim::{Plant, SimError};
use serde::Serialize;

use crate::Error;
use crate::robot::Robot;

dynid_record::words! {
    /// Law of the normal force in a bearing, as in robot files.
    ContactLawName {
        /// Rough surfaces.
        Rough = "rough",
        /// Lankarani and Nikravesh.
        LankaraniNikravesh = "lankarani_nikravesh",
        /// Hertz.
        Hertz = "hertz",
        /// Kelvin and Voigt.
        KelvinVoigt = "kelvin_voigt",
    }
}

impl From<&ContactLaw> for ContactLawName {
    fn from(law: &ContactLaw) -> Self {
        match law {
            ContactLaw::Fractal(_) => ContactLawName::Rough,
            ContactLaw::LankaraniNikravesh(_) => ContactLawName::LankaraniNikravesh,
            ContactLaw::Hertz(_) => ContactLawName::Hertz,
            ContactLaw::KelvinVoigt(_) => ContactLawName::KelvinVoigt,
        }
    }
}

/// A joint with clearance, and its journal at rest under gravity with all joints at zero.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct ClearanceRow {
    /// Joint.
    pub joint: String,
    /// Radial clearance, m.
    pub gap: f64,
    /// Radius of the journal, m.
    pub journal_radius: f64,
    /// Radius of the bearing, m.
    pub bearing_radius: f64,
    /// Law of the normal force.
    pub law: ContactLawName,
    /// Coefficient of sliding friction.
    pub friction: f64,
    /// The journal at rest; `None` where no load presses it against its bearing.
    pub at_rest: Option<RestingJournal>,
}

/// A journal at rest in its bearing.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct RestingJournal {
    /// Reaction of the bearing, N.
    pub load: f64,
    /// Penetration, m.
    pub penetration: f64,
    /// Normal stiffness there, N/m.
    pub stiffness: f64,
    /// Swing along the bearing, a pendulum as long as the offset, other journals following freely; Hz.
    pub swing_hz: f64,
    /// Least sample rate that shows it, five samples a period, Hz.
    pub sample_rate_hz: f64,
    /// Doubts about the law.
    pub remarks: Vec<String>,
}

/// Share of the robot's weight below which a reaction is rounding.
const NO_LOAD: f64 = 1e-9;

pub(super) fn rows(robot: &Robot) -> Result<Vec<ClearanceRow>, Error> {
    let Some(model) = robot.with_clearance()? else { return Ok(Vec::new()) };
    let linear = model.parameters().prior();
    let plant = match Plant::new(model, linear, Vec::new(), 1.0) {
        Ok(plant) => Some(plant),
        // It has no position zero.
        Err(SimError::FloatingBase) => None,
        Err(other) => return Err(other.into()),
    };
    let mut loads = match &plant {
        Some(plant) => loads(plant),
        None => Vec::new(),
    }
    .into_iter();
    let specs = robot.elements.clearance.iter();
    Ok(specs
        .map(|spec| ClearanceRow {
            joint: spec.joint.clone(),
            gap: spec.gap(),
            journal_radius: spec.journal_radius,
            bearing_radius: spec.journal_radius + spec.gap(),
            law: (&spec.law).into(),
            friction: spec.friction.coefficient,
            at_rest: loads.next().flatten().map(|(load, compliance)| {
                let law = &spec.law;
                let penetration = law.static_penetration(load);
                let offset = spec.gap() + penetration;
                let swing_hz = (load * compliance / offset).sqrt() / std::f64::consts::TAU;
                RestingJournal {
                    load,
                    penetration,
                    stiffness: law.at(penetration, law.impact_speed_floor()).elastic_slope,
                    swing_hz,
                    sample_rate_hz: 5.0 * swing_hz,
                    remarks: law.validity(penetration).remarks(),
                }
            }),
        })
        .collect())
}

/// Per joint with clearance: reaction at the journal with everything at rest at zero (N), and the acceleration that a unit
/// force at right angles to it gives the journal (1/kg).
fn loads(plant: &Plant) -> Vec<Option<(f64, f64)>> {
    let n = plant.joints();
    let still = vec![0.0; n];
    let mut work = plant.workspace();
    let model: &RobotModel = plant.model();
    let channels = vec![0.0; model.channels().len()];
    let holding = plant.drive_effort([&still, &still, &still], &channels, &mut work);
    let mass = plant.mass_matrix(&still, &mut work);
    let free: Vec<usize> = model.clearances().flat_map(|c| c.translations).collect();
    let own: Vec<Vec<f64>> = free.iter().map(|r| free.iter().map(|c| mass[r * n + c]).collect()).collect();
    let weight = mass.iter().fold(0.0_f64, |m, x| m.max(x.abs())) * model.mechanism().gravity().norm();
    let Some(inverse) = crate::elements::inverse(&own) else { return Vec::new() };
    let reactions = model.clearances().enumerate().map(|(c, contact)| {
        let [x, y] = contact.translations.map(|rate| holding[rate]);
        let load = x.hypot(y);
        if !load.is_finite() || load <= NO_LOAD * weight {
            return None;
        }
        let across = [-y / load, x / load];
        let along = |i: usize, j: usize| across[i] * inverse[2 * c + i][2 * c + j] * across[j];
        Some((load, along(0, 0) + along(0, 1) + along(1, 0) + along(1, 1)))
    });
    reactions.collect()
}
