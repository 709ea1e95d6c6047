//! Reference numbers of an independent implementation (NumPy), embedded.

use serde::Deserialize;

use super::parameters::PARAMETERS;
use super::pointing::JOINTS;
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

pub(super) fn dynamics() -> Result<DynamicsReference, StudyError> {
    parse("xy_pointing/reference/dynamics.json", include_str!("reference/dynamics.json"))
}

pub(super) fn trajectory() -> Result<TrajectoryReference, StudyError> {
    parse("xy_pointing/reference/trajectory.json", include_str!("reference/trajectory.json"))
}

pub(super) fn table() -> Result<TableReference, StudyError> {
    parse("xy_pointing/reference/table3.json", include_str!("reference/table3.json"))
}
