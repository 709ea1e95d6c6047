//! The study's data, parsed.

use serde::Deserialize;

use super::JOINTS;
use super::bearing::Bearing;
use crate::StudyError;

const FILE: &str = "xy_pointing/settings.toml";

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    /// rad/s.
    pub(super) base_frequency: f64,
    /// Of a trajectory of our own, rad/s.
    pub(super) faster_frequency: f64,
    /// rad/s².
    pub(super) acceleration: [f64; JOINTS],
    pub(super) samples: usize,
    /// `[q0, a.., b..]` per joint, rad.
    pub(super) trajectory: Vec<Vec<f64>>,
    pub(super) table3: Vec<PrintedRow>,
    pub(super) bearing: Bearing,
    pub(super) data: DataSettings,
}

/// What is recorded of a period.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DataSettings {
    pub(super) samples: usize,
    /// At the start of the period, s.
    pub(super) discarded: f64,
    /// Standard deviation, N m.
    pub(super) torque_noise: f64,
}

/// A row of the paper's Table 3.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PrintedRow {
    pub(super) name: String,
    pub(super) system: f64,
    pub(super) clearance: f64,
    pub(super) ideal: f64,
    pub(super) ratio: f64,
}

impl Settings {
    pub(super) fn read() -> Result<Self, StudyError> {
        toml::from_str(include_str!("settings.toml"))
            .map_err(|e| StudyError::Data { file: FILE, message: e.to_string() })
    }
}
