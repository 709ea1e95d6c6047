//! Reference numbers of an independent implementation (NumPy), embedded.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::JOINTS;
use super::parameters::PARAMETERS;
use crate::StudyError;
use crate::reference::parse;

#[derive(Debug, Deserialize)]
pub(super) struct DynamicsReference {
    pub(super) states: Vec<StateReference>,
}

/// Offsets of the journals in the axes of the links; torques without friction.
#[derive(Debug, Deserialize)]
pub(super) struct StateReference {
    pub(super) q: [f64; JOINTS],
    pub(super) qd: [f64; JOINTS],
    pub(super) qdd: [f64; JOINTS],
    pub(super) e: [f64; 2 * JOINTS],
    pub(super) ed: [f64; 2 * JOINTS],
    pub(super) edd: [f64; 2 * JOINTS],
    pub(super) p: [f64; PARAMETERS],
    pub(super) tau: [f64; JOINTS],
    #[serde(rename = "F1_frame1")]
    pub(super) force1: [f64; 2],
    #[serde(rename = "F2_frame2")]
    pub(super) force2: [f64; 2],
    pub(super) theta: [f64; PARAMETERS],
    pub(super) regressor: [[f64; PARAMETERS]; JOINTS],
}

#[derive(Debug, Deserialize)]
pub(super) struct TrajectoryReference {
    pub(super) samples: Vec<SampleReference>,
    pub(super) q_min: [f64; JOINTS],
    pub(super) q_max: [f64; JOINTS],
    pub(super) abs_qd_max: [f64; JOINTS],
    pub(super) abs_qdd_max: [f64; JOINTS],
    pub(super) omega_f_max_allowed: f64,
    pub(super) cond_base_200_samples: f64,
    pub(super) cond_base_column_normalised: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct SampleReference {
    pub(super) t: f64,
    pub(super) q: [f64; JOINTS],
    pub(super) qd: [f64; JOINTS],
    pub(super) qdd: [f64; JOINTS],
}

#[derive(Debug, Deserialize)]
pub(super) struct TableReference {
    pub(super) rows: Vec<RatioReference>,
    pub(super) closer_with_clearance: usize,
}

#[derive(Debug, Deserialize)]
pub(super) struct RatioReference {
    pub(super) name: String,
    pub(super) recomputed: f64,
    pub(super) matches_3_digits: bool,
}

#[derive(Debug, Deserialize)]
pub(super) struct ContactReference {
    pub(super) cases: Vec<ContactCase>,
    pub(super) friction_c_d: Vec<DirectionReference>,
    pub(super) k_mu: Vec<FactorReference>,
}

#[derive(Debug, Deserialize)]
pub(super) struct ContactCase {
    pub(super) constants: BTreeMap<String, f64>,
    pub(super) points: Vec<PointReference>,
    #[serde(rename = "K_m_literal_K")]
    pub(super) literal: Vec<LiteralReference>,
    /// Of the surface.
    #[serde(flatten)]
    pub(super) surface: BTreeMap<String, f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct PointReference {
    pub(super) delta: f64,
    pub(super) forces: Vec<ForceReference>,
    #[serde(flatten)]
    pub(super) values: BTreeMap<String, f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct ForceReference {
    pub(super) delta_dot: f64,
    #[serde(rename = "F_n")]
    pub(super) force: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct LiteralReference {
    pub(super) delta: f64,
    #[serde(rename = "K_m")]
    pub(super) stiffness: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct DirectionReference {
    pub(super) v_t: f64,
    pub(super) v_0: f64,
    pub(super) v_m: f64,
    pub(super) c_d: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct FactorReference {
    pub(super) mu: f64,
    pub(super) k_mu: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct SimulationReference {
    pub(super) at_0_5s: InstantReference,
    pub(super) full_period: PeriodReference,
}

#[derive(Debug, Deserialize)]
pub(super) struct InstantReference {
    pub(super) e: [f64; 2 * JOINTS],
    #[serde(rename = "F_n")]
    pub(super) force: [f64; JOINTS],
    pub(super) penetration: [f64; JOINTS],
    pub(super) tolerance_rel: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct PeriodReference {
    pub(super) rms_ideal_torque: [f64; JOINTS],
    pub(super) rms_clearance_minus_ideal_no_friction: [f64; JOINTS],
    pub(super) rms_friction_torque: [f64; JOINTS],
    #[serde(rename = "F_n_min")]
    pub(super) least_force: [f64; JOINTS],
    #[serde(rename = "F_n_max")]
    pub(super) largest_force: [f64; JOINTS],
    pub(super) max_penetration_incl_impact: [f64; JOINTS],
    pub(super) impacts: usize,
    pub(super) tolerance_rel: f64,
}

pub(super) fn contact() -> Result<ContactReference, StudyError> {
    parse("xy_pointing/reference/contact.json", include_str!("reference/contact.json"))
}

pub(super) fn simulation() -> Result<SimulationReference, StudyError> {
    parse("xy_pointing/reference/simulation.json", include_str!("reference/simulation.json"))
}

pub(super) fn dynamics() -> Result<DynamicsReference, StudyError> {
    parse("xy_pointing/reference/dynamics.json", include_str!("reference/dynamics.json"))
}

pub(super) fn trajectory() -> Result<TrajectoryReference, StudyError> {
    parse("xy_pointing/reference/trajectory.json", include_str!("reference/trajectory.json"))
}

pub(super) fn table() -> Result<TableReference, StudyError> {
    parse("xy_pointing/reference/table3.json", include_str!("reference/table3.json"))
}
