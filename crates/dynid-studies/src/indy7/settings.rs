//! The study's data, parsed.

use serde::Deserialize;

use super::JOINTS;
use crate::StudyError;

const FILE: &str = "indy7/settings.toml";

/// One number per joint.
pub(super) type PerJoint = [f64; JOINTS];

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub(super) friction: [Friction; JOINTS],
    pub(super) thermal: Thermal,
    pub(super) simulation: Simulation,
    pub(super) limits: Limits,
    pub(super) trajectories: Trajectories,
    pub(super) table_a2: TableA2,
    pub(super) paper: Paper,
}

/// Friction of a joint; `sigma*`: value at 0 °C and slope.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Friction {
    pub(super) coulomb: f64,
    #[serde(rename = "static")]
    pub(super) fixed: f64,
    pub(super) stribeck_speed: f64,
    pub(super) sigma0: f64,
    pub(super) sigma1: f64,
    pub(super) sigma2: [f64; 2],
    pub(super) sigma3: [f64; 2],
    pub(super) sigma4: [f64; 2],
}

/// Temperatures, °C; the drift model's time constant, s, and steady rise, K.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Thermal {
    pub(super) cold: f64,
    pub(super) moderate: f64,
    pub(super) hot: f64,
    pub(super) levels: Vec<f64>,
    pub(super) valid: [f64; 2],
    pub(super) ambient: f64,
    pub(super) time_constant: f64,
    pub(super) rise: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Simulation {
    pub(super) rate_hz: f64,
    pub(super) encoder_bits: u32,
    pub(super) velocity_noise: f64,
    pub(super) torque_noise: PerJoint,
    pub(super) ripple: PerJoint,
    pub(super) cutoff_hz: f64,
    pub(super) decimation: usize,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Limits {
    pub(super) acceleration: PerJoint,
    pub(super) height: f64,
    pub(super) column_radius: f64,
    pub(super) column_height: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Trajectories {
    pub(super) excitation: Vec<Vec<f64>>,
    pub(super) validation: [Vec<Vec<f64>>; 3],
}

/// Table A2 of the paper.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TableA2 {
    /// Standard parameters with these base values, feasible in the paper's sense.
    pub(super) standard: Vec<f64>,
    pub(super) proposed_cold: Vec<f64>,
    pub(super) proposed_hot: Vec<f64>,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Paper {
    /// Table 3.
    pub(super) cold: PaperTable,
    /// Table 4.
    pub(super) hot: PaperTable,
}

/// RMSE per trajectory and joint, N m.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PaperTable {
    pub(super) conventional: [PerJoint; 3],
    pub(super) proposed: [PerJoint; 3],
}

impl Settings {
    pub(super) fn read() -> Result<Self, StudyError> {
        toml::from_str(include_str!("settings.toml"))
            .map_err(|e| StudyError::Data { file: FILE, message: e.to_string() })
    }
}
