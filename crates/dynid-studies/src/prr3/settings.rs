//! The study's data, parsed.

use serde::Deserialize;

use crate::StudyError;

const FILE: &str = "prr3/settings.toml";

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Settings {
    /// m/s².
    pub(super) gravity: f64,
    pub(super) platform: Vec<String>,
    pub(super) parameter: Vec<Inertial>,
    pub(super) friction: Vec<Friction>,
    /// Per slider: parameters with their shares.
    pub(super) weight: Vec<Vec<(String, f64)>>,
    pub(super) base_columns: Vec<String>,
    pub(super) body: Vec<BodyNames>,
    pub(super) body_margin: f64,
    pub(super) trajectory: TrajectorySettings,
    pub(super) circle: Circle,
    pub(super) limits: Limits,
    pub(super) criterion: CriterionSettings,
    pub(super) noise: Noise,
}

/// A row of Table 1.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Inertial {
    pub(super) name: String,
    pub(super) unit: String,
    /// Standard parameters that it is: joint of the body, place among its ten.
    pub(super) of: Vec<(String, usize)>,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) design: f64,
    pub(super) estimate: f64,
}

/// Settings of friction.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Friction {
    pub(super) name: String,
    pub(super) unit: String,
    pub(super) lower: f64,
    pub(super) start: f64,
    pub(super) estimate: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyNames {
    pub(super) name: String,
    pub(super) mass: String,
    pub(super) moment: String,
    pub(super) inertia: String,
    /// m.
    pub(super) length: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrajectorySettings {
    /// s.
    pub(super) period: f64,
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) samples: usize,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Circle {
    /// m.
    pub(super) centre: [f64; 2],
    /// m.
    pub(super) radius: f64,
    pub(super) angle: f64,
    /// s.
    pub(super) duration: f64,
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Limits {
    pub(super) slider_acceleration: f64,
    pub(super) angle: f64,
    pub(super) angle_between: f64,
    pub(super) distances: [f64; 2],
    pub(super) height: [f64; 2],
    pub(super) legs: Vec<(String, f64)>,
    pub(super) x: (f64, f64),
    pub(super) y: (f64, f64),
    pub(super) speed: [f64; 2],
    pub(super) acceleration: [f64; 2],
}

#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CriterionSettings {
    pub(super) condition: f64,
    pub(super) smallest: f64,
    pub(super) samples: usize,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Noise {
    /// N.
    pub(super) force: f64,
    /// m.
    pub(super) encoder: f64,
}

impl Settings {
    pub(super) fn read() -> Result<Self, StudyError> {
        toml::from_str(include_str!("settings.toml"))
            .map_err(|e| StudyError::Data { file: FILE, message: e.to_string() })
    }

    /// Place of an inertial parameter.
    pub(super) fn place(&self, name: &str) -> Result<usize, StudyError> {
        let found = self.parameter.iter().position(|p| p.name == name);
        found.ok_or_else(|| StudyError::Data { file: FILE, message: format!("no parameter `{name}`") })
    }

    /// Names with units, inertial parameters first.
    pub(super) fn names(&self) -> Vec<(&str, &str)> {
        let inertial = self.parameter.iter().map(|p| (p.name.as_str(), p.unit.as_str()));
        inertial.chain(self.friction.iter().map(|p| (p.name.as_str(), p.unit.as_str()))).collect()
    }

    /// All parameters of one column of the table.
    fn all(&self, inertial: impl Fn(&Inertial) -> f64, friction: impl Fn(&Friction) -> f64) -> Vec<f64> {
        self.parameter.iter().map(inertial).chain(self.friction.iter().map(friction)).collect()
    }

    /// What data are made with.
    pub(super) fn truth(&self) -> Vec<f64> {
        self.all(|p| p.estimate, |f| f.estimate)
    }

    /// Where fits set out from.
    pub(super) fn start(&self) -> Vec<f64> {
        self.all(|p| p.design, |f| f.start)
    }

    pub(super) fn lower(&self) -> Vec<f64> {
        self.all(|p| p.lower, |f| f.lower)
    }

    pub(super) fn upper(&self) -> Vec<f64> {
        self.all(|p| p.upper, |_| f64::INFINITY)
    }
}
