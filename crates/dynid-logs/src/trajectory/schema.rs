//! Keys of the coefficients file.

use serde::{Deserialize, Serialize};

/// Schema of the files that are read and written.
pub(super) const SCHEMA: &str = "dynid-trajectory/1";

#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct FileKeys {
    pub(super) schema: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) robot: Option<String>,
    pub(super) form: FormKey,
    pub(super) base_frequency_rad_s: f64,
    #[serde(default = "one")]
    pub(super) periods: usize,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) joints: Option<Vec<JointKeys>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) table: Option<TableKeys>,
    #[serde(default)]
    pub(super) approach: Option<ApproachKeys>,
    #[serde(default, rename = "return")]
    pub(super) back: Option<ReturnKeys>,
    #[serde(default)]
    pub(super) sample_rate_hz: Option<f64>,
}

fn one() -> usize {
    1
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "snake_case")]
pub(super) enum FormKey {
    Plain,
    VelocityAmplitudes,
}

#[derive(Debug, Clone, Copy, Default, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub(super) enum UnitKey {
    #[default]
    Rad,
    M,
    Deg,
}

#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct JointKeys {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) name: Option<String>,
    #[serde(default)]
    pub(super) unit: UnitKey,
    pub(super) q0: f64,
    pub(super) a: Vec<f64>,
    pub(super) b: Vec<f64>,
}

#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct TableKeys {
    pub(super) order: String,
    pub(super) rows: Vec<Vec<f64>>,
    #[serde(default)]
    pub(super) names: Option<Vec<String>>,
    #[serde(default)]
    pub(super) unit: UnitKey,
}

#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ApproachKeys {
    pub(super) from: Vec<f64>,
    pub(super) duration_s: f64,
}

#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields)]
pub(super) struct ReturnKeys {
    pub(super) to: Vec<f64>,
    pub(super) duration_s: f64,
}
