//! Reference numbers of an independent implementation (NumPy), embedded.

use serde::Deserialize;

use crate::StudyError;
use crate::reference::parse;

#[derive(Debug, Deserialize)]
pub(super) struct DynamicsReference {
    pub(super) independent: Vec<String>,
    pub(super) grouping_matrix_15x30: Vec<Vec<f64>>,
    pub(super) states: Vec<StateReference>,
}

#[derive(Debug, Deserialize)]
pub(super) struct StateReference {
    pub(super) q: [f64; 3],
    pub(super) qd: [f64; 3],
    pub(super) qdd: [f64; 3],
    pub(super) tau_rigid: [f64; 3],
    pub(super) friction: [f64; 3],
    #[serde(rename = "fk_frame3_R")]
    pub(super) rotation: [[f64; 3]; 3],
    #[serde(rename = "fk_frame3_p")]
    pub(super) position: [f64; 3],
    pub(super) regressor_base_3x15: Vec<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct SmoothingReference {
    pub(super) input: Vec<f64>,
    pub(super) pass1: Vec<f64>,
    pub(super) pass3: Vec<f64>,
    pub(super) cubic_input: Vec<f64>,
    pub(super) cubic_output: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct TentReference {
    pub(super) gamma: f64,
    pub(super) compare_first: usize,
    pub(super) sequence: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct DifferentiationReference {
    pub(super) period: f64,
    pub(super) sample_time: f64,
    pub(super) harmonics: usize,
    pub(super) input: Vec<f64>,
    pub(super) position: Vec<f64>,
    pub(super) velocity: Vec<f64>,
    pub(super) acceleration: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct TrajectoryReference {
    pub(super) appendix_a1: Vec<Vec<f64>>,
    pub(super) appendix_evaluations: Vec<AppendixReference>,
}

#[derive(Debug, Deserialize)]
pub(super) struct AppendixReference {
    pub(super) order: String,
    pub(super) q_min_deg: [f64; 3],
    pub(super) q_max_deg: [f64; 3],
    pub(super) max_abs_qd_deg: [f64; 3],
    pub(super) max_abs_qdd_deg: [f64; 3],
    pub(super) cond_phi15: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct IdentificationReference {
    pub(super) q: Vec<[f64; 3]>,
    pub(super) qd: Vec<[f64; 3]>,
    pub(super) qdd: Vec<[f64; 3]>,
    pub(super) tau: Vec<[f64; 3]>,
    pub(super) objective_cases: Vec<ObjectiveCase>,
    pub(super) reference_ls: LeastSquaresReference,
}

#[derive(Debug, Deserialize)]
pub(super) struct ObjectiveCase {
    pub(super) x: Vec<f64>,
    #[serde(rename = "F")]
    pub(super) objective: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct LeastSquaresReference {
    pub(super) rss: f64,
}

pub(super) fn dynamics() -> Result<DynamicsReference, StudyError> {
    parse("er16/reference/dynamics.json", include_str!("reference/dynamics.json"))
}

pub(super) fn smoothing() -> Result<SmoothingReference, StudyError> {
    parse("er16/reference/smoothing.json", include_str!("reference/smoothing.json"))
}

pub(super) fn tent() -> Result<TentReference, StudyError> {
    parse("er16/reference/tent.json", include_str!("reference/tent.json"))
}

pub(super) fn differentiation() -> Result<DifferentiationReference, StudyError> {
    parse("er16/reference/freqdiff.json", include_str!("reference/freqdiff.json"))
}

pub(super) fn trajectory() -> Result<TrajectoryReference, StudyError> {
    parse("er16/reference/trajectory.json", include_str!("reference/trajectory.json"))
}

pub(super) fn identification() -> Result<IdentificationReference, StudyError> {
    parse("er16/reference/identification.json", include_str!("reference/identification.json"))
}
