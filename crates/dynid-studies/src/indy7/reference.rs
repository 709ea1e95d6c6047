//! Reference numbers of an independent implementation (NumPy, SciPy and a conic solver), embedded.

use serde::Deserialize;

use super::settings::PerJoint;
use crate::StudyError;
use crate::reference::{PARAMETER_ORDER, parse};

#[derive(Debug, Deserialize)]
pub(super) struct DynamicsReference {
    pub(super) phi_standard: Vec<f64>,
    pub(super) states: Vec<StateReference>,
}

#[derive(Debug, Deserialize)]
pub(super) struct StateReference {
    pub(super) q: PerJoint,
    pub(super) qd: PerJoint,
    pub(super) qdd: PerJoint,
    pub(super) tau: PerJoint,
    pub(super) tau_without_rotor: PerJoint,
    #[serde(rename = "fk_frame6_R")]
    pub(super) rotation: [[f64; 3]; 3],
    #[serde(rename = "fk_frame6_p")]
    pub(super) position: [f64; 3],
    pub(super) regressor_6x66: Option<Vec<Vec<f64>>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct BaseReference {
    pub(super) independent: Vec<String>,
    pub(super) grouping_matrix: Vec<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct FrictionReference {
    pub(super) steady: Vec<SteadyReference>,
    pub(super) lugre: SequenceReference,
}

#[derive(Debug, Deserialize)]
pub(super) struct SteadyReference {
    #[serde(rename = "T")]
    pub(super) temperature: f64,
    pub(super) qd: f64,
    pub(super) tau_f: PerJoint,
}

#[derive(Debug, Deserialize)]
pub(super) struct SequenceReference {
    pub(super) dt: f64,
    #[serde(rename = "T")]
    pub(super) temperature: f64,
    pub(super) qd: Vec<PerJoint>,
    pub(super) tau_f: Vec<PerJoint>,
}

#[derive(Debug, Deserialize)]
pub(super) struct FilterReference {
    pub(super) input: Vec<f64>,
    pub(super) output: Vec<f64>,
    pub(super) compare_from: usize,
    pub(super) compare_to: usize,
}

#[derive(Debug, Deserialize)]
pub(super) struct TrajectoryReference {
    pub(super) samples: Vec<SampleReference>,
    #[serde(rename = "cond_W_58")]
    pub(super) condition_58: f64,
    #[serde(rename = "cond_W_inertial_40")]
    pub(super) condition_40: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct SampleReference {
    pub(super) t: f64,
    pub(super) q: PerJoint,
    pub(super) qd: PerJoint,
    pub(super) qdd: PerJoint,
}

#[derive(Debug, Deserialize)]
pub(super) struct LeastSquaresReference {
    pub(super) q: Vec<PerJoint>,
    pub(super) qd: Vec<PerJoint>,
    pub(super) qdd: Vec<PerJoint>,
    pub(super) tau: Vec<PerJoint>,
    pub(super) ols: Vec<f64>,
    pub(super) wls: Vec<f64>,
}

#[derive(Debug, Deserialize)]
pub(super) struct FeasibleReference {
    pub(super) cases: Vec<ProjectionReference>,
}

#[derive(Debug, Deserialize)]
pub(super) struct ProjectionReference {
    pub(super) target: Vec<f64>,
    pub(super) objective_bl: Option<f64>,
    pub(super) solution_bl: Option<Vec<f64>>,
    pub(super) objective_pseudo_inertia: Option<f64>,
    pub(super) solution_pseudo_inertia: Option<Vec<f64>>,
}

/// Column of the reference's 66, in which each link's rotor is its last parameter, in ours: ten per link, then the rotors.
pub(super) fn column(reference: usize) -> usize {
    let (link, k) = (reference / 11, reference % 11);
    if k == 10 { 10 * super::JOINTS + link } else { 10 * link + PARAMETER_ORDER[k] }
}

/// Standard parameters in our order.
pub(super) fn standard(reference: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; reference.len()];
    for (k, value) in reference.iter().enumerate() {
        out[column(k)] = *value;
    }
    out
}

/// Joint after joint, one number per row.
pub(super) fn transposed(rows: &[PerJoint]) -> Vec<f64> {
    (0..super::JOINTS).flat_map(|j| rows.iter().map(move |r| r[j])).collect()
}

macro_rules! embedded {
    ($name:ident, $type:ty, $file:literal) => {
        pub(super) fn $name() -> Result<$type, StudyError> {
            parse(concat!("indy7/reference/", $file), include_str!(concat!("reference/", $file)))
        }
    };
}

embedded!(dynamics, DynamicsReference, "dynamics.json");
embedded!(base, BaseReference, "base.json");
embedded!(friction, FrictionReference, "friction.json");
embedded!(filter, FilterReference, "filter.json");
embedded!(trajectory, TrajectoryReference, "trajectory.json");
embedded!(least_squares, LeastSquaresReference, "least_squares.json");
embedded!(feasible, FeasibleReference, "feasible.json");
