//! The study's data, parsed.

use serde::Deserialize;

use crate::StudyError;

const FILE: &str = "er16/settings.toml";

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub(super) workspace: Workspace,
    pub(super) acceleration_deg: [f64; 3],
    pub(super) fundamental_hz: f64,
    pub(super) torque_noise: [f64; 3],
    pub(super) position_noise: f64,
    pub(super) search_rate_hz: f64,
    pub(super) reference: Vec<Vec<f64>>,
    pub(super) unknowns: Vec<Unknown>,
    pub(super) paper: Paper,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Workspace {
    pub(super) height: f64,
    pub(super) radius: f64,
}

/// An unknown of the identification with its true value.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Unknown {
    pub(super) name: String,
    pub(super) value: f64,
    pub(super) bounds: [f64; 2],
}

/// What the paper prints.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Paper {
    pub(super) correlation_pso: [f64; 3],
    pub(super) correlation_cs: [f64; 3],
    pub(super) correlation_ics: [f64; 3],
    pub(super) objective_ics: f64,
    pub(super) objective_cs: f64,
    pub(super) objective_pso: f64,
}

impl Settings {
    pub(super) fn read() -> Result<Self, StudyError> {
        toml::from_str(include_str!("settings.toml"))
            .map_err(|e| StudyError::Data { file: FILE, message: e.to_string() })
    }

    pub(super) fn base_frequency(&self) -> f64 {
        std::f64::consts::TAU * self.fundamental_hz
    }
}
