//! Reference numbers of an independent implementation (NumPy), embedded.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::machine::SLIDERS;
use crate::StudyError;
use crate::reference::parse;

/// Table 1's inertial parameters.
const INERTIAL: usize = 13;

#[derive(Debug, Deserialize)]
pub(super) struct DynamicsReference {
    pub(super) states: Vec<StateReference>,
    pub(super) tolerance: Tolerance,
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Tolerance {
    pub(super) abs: f64,
    pub(super) rel: f64,
}

/// Coordinates `x1 x2 x3 y1 y2 y3 α1 α2 α3 x y θ`.
#[derive(Debug, Deserialize)]
pub(super) struct StateReference {
    pub(super) pose: [f64; 3],
    pub(super) pose_d: [f64; 3],
    pub(super) pose_dd: [f64; 3],
    pub(super) g: f64,
    pub(super) phi: [f64; INERTIAL],
    pub(super) q: [f64; 12],
    pub(super) qd: [f64; 12],
    pub(super) qdd: [f64; 12],
    pub(super) tau_frictionless: [f64; SLIDERS],
    #[serde(rename = "lambda_")]
    pub(super) multipliers: [f64; 9],
    #[serde(rename = "lambda_without_y_in_loops")]
    pub(super) as_published: [f64; 9],
    #[serde(rename = "Mbar")]
    pub(super) mass: [[f64; SLIDERS]; SLIDERS],
    #[serde(rename = "Nbar")]
    pub(super) bias: [f64; SLIDERS],
    pub(super) regressor: [[f64; INERTIAL]; SLIDERS],
    pub(super) check_sum_normals: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct FrictionReference {
    pub(super) states: Vec<FrictionState>,
    pub(super) tolerance: Tolerance,
}

#[derive(Debug, Deserialize)]
pub(super) struct FrictionState {
    pub(super) pose: [f64; 3],
    pub(super) pose_d: [f64; 3],
    pub(super) pose_dd: [f64; 3],
    pub(super) slider_velocity: [f64; SLIDERS],
    pub(super) normal_z: [f64; SLIDERS],
    pub(super) normal_y: [f64; SLIDERS],
    pub(super) tau_frictionless: [f64; SLIDERS],
    pub(super) tau_stribeck: [f64; SLIDERS],
    pub(super) tau_cv: [f64; SLIDERS],
}

#[derive(Debug, Deserialize)]
pub(super) struct TrajectoryReference {
    pub(super) n_samples: usize,
    pub(super) slider_min: [f64; SLIDERS],
    pub(super) slider_max: [f64; SLIDERS],
    pub(super) abs_slider_speed_max: [f64; SLIDERS],
    pub(super) abs_slider_acc_max: [f64; SLIDERS],
    pub(super) base_singular_values: Vec<f64>,
    pub(super) tau_frictionless_rms: [f64; SLIDERS],
    pub(super) tau_full_rms: [f64; SLIDERS],
    pub(super) tau_full_absmax: [f64; SLIDERS],
    pub(super) abs_normal_z_max: [f64; SLIDERS],
    pub(super) samples: Vec<SampleReference>,
    pub(super) tolerance: Tolerance,
}

#[derive(Debug, Deserialize)]
pub(super) struct SampleReference {
    pub(super) t: f64,
    pub(super) pose: [f64; 3],
    pub(super) sliders: [f64; SLIDERS],
    pub(super) slider_v: [f64; SLIDERS],
    pub(super) tau: [f64; SLIDERS],
}

#[derive(Debug, Deserialize)]
pub(super) struct IdentifiabilityReference {
    #[serde(rename = "relative_scaled_singular_values_17")]
    pub(super) singular_values: Vec<f64>,
    pub(super) rank: usize,
    pub(super) tolerance_rel: f64,
    #[serde(rename = "base_matrix_9x13")]
    pub(super) base_matrix: Vec<[f64; INERTIAL]>,
    #[serde(rename = "base_values_at_table1_estimates")]
    pub(super) base_values: Vec<f64>,
    /// By the names of [`NULL_NAMES`].
    pub(super) inertial_null_space: Vec<BTreeMap<String, f64>>,
}

/// Names of Table 1's inertial parameters in the reference files.
const NULL_NAMES: [&str; INERTIAL] =
    ["ms", "mL1", "mL2", "mL3", "mp", "mL1c1", "mL2c2", "mL3c3", "mpxp", "IL1", "IL2", "IL3", "Ip"];

impl IdentifiabilityReference {
    /// Directions in Table 1's order.
    pub(super) fn null_directions(&self) -> Vec<[f64; INERTIAL]> {
        let of = |d: &BTreeMap<String, f64>| NULL_NAMES.map(|n| d.get(n).copied().unwrap_or(0.0));
        self.inertial_null_space.iter().map(of).collect()
    }
}

pub(super) fn dynamics() -> Result<DynamicsReference, StudyError> {
    parse("prr3/reference/dynamics.json", include_str!("reference/dynamics.json"))
}

pub(super) fn friction() -> Result<FrictionReference, StudyError> {
    parse("prr3/reference/friction.json", include_str!("reference/friction.json"))
}

pub(super) fn trajectory() -> Result<TrajectoryReference, StudyError> {
    parse("prr3/reference/trajectory.json", include_str!("reference/trajectory.json"))
}

pub(super) fn identifiability() -> Result<IdentifiabilityReference, StudyError> {
    parse("prr3/reference/identifiability.json", include_str!("reference/identifiability.json"))
}
