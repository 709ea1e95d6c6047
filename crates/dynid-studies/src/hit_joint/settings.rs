//! The study's data, parsed.

use serde::Deserialize;

use super::Values;
use crate::StudyError;

const FILE: &str = "hit_joint/settings.toml";

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    pub(super) ratio: f64,
    pub(super) truth: Truth,
    pub(super) chosen: Chosen,
    pub(super) full: Full,
    pub(super) programme: Programme,
    pub(super) noise: Noise,
    pub(super) online: Online,
    pub(super) catalogue: Catalogue,
    pub(super) paper: Paper,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
#[expect(non_snake_case, reason = "names of the paper")]
pub(super) struct Truth {
    k1: f64,
    k2: f64,
    b_in: f64,
    b_inD: f64,
    b_out: f64,
    b_outC: f64,
}

impl Truth {
    /// In the order of the six parameters.
    pub(super) fn values(&self) -> Values {
        [self.k1, self.k2, self.b_in, self.b_inD, self.b_out, self.b_outC]
    }
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Chosen {
    pub(super) motor_inertia: f64,
    pub(super) link_inertia: f64,
}

/// Input friction beyond Coulomb and viscous, and the torque once a turn.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Full {
    pub(super) tanh: f64,
    pub(super) tanh_speed: f64,
    pub(super) fading: f64,
    pub(super) fading_speed: f64,
    pub(super) cyclic: f64,
    pub(super) cyclic_phase: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Programme {
    pub(super) blend_s: f64,
    pub(super) cruise_s: f64,
    speeds_deg: Vec<f64>,
    pub(super) load_mean: f64,
    pub(super) load_amplitude: f64,
    pub(super) load_period_s: f64,
    pub(super) rate_hz: f64,
    pub(super) decimation: usize,
    pub(super) online_rate_hz: f64,
}

impl Programme {
    /// Cruise speeds of the link, rad/s, each forth and back.
    pub(super) fn speeds(&self) -> Vec<f64> {
        self.speeds_deg.iter().map(|v| v.to_radians()).flat_map(|v| [v, -v]).collect()
    }

    /// Samples of a second in decimated data.
    pub(super) fn decimated_rate_hz(&self) -> f64 {
        self.rate_hz / self.decimation as f64
    }
}

/// Standard deviations of what is measured.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Noise {
    pub(super) deformation: f64,
    pub(super) motor_torque: f64,
    pub(super) link_torque: f64,
    pub(super) motor_speed: f64,
    pub(super) link_speed: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Online {
    pub(super) units: Values,
    /// Standard deviation of the start, in units.
    pub(super) start_std: f64,
    pub(super) alpha: f64,
    pub(super) beta: f64,
    pub(super) floor: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Catalogue {
    pub(super) torques: [f64; 2],
    pub(super) largest: f64,
}

/// Tables I to III of the paper.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Paper {
    pub(super) eq1_none: [f64; 2],
    pub(super) eq2_none: [f64; 2],
    pub(super) coupled_none: [f64; 2],
    pub(super) eq1_coulomb: [f64; 3],
    pub(super) eq2_coulomb: [f64; 3],
    pub(super) full: Values,
}

impl Settings {
    pub(super) fn read() -> Result<Self, StudyError> {
        toml::from_str(include_str!("settings.toml"))
            .map_err(|e| StudyError::Data { file: FILE, message: e.to_string() })
    }
}
