//! Estimated parameters.

use serde::Serialize;

/// Where a parameter's value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ParameterVerdict {
    /// Determined by the logs.
    SeenInData,
    /// Determined mostly by the prior.
    CarriedByPrior,
    /// No motion of this mechanism, or none in these logs, determines it.
    NotIdentifiable,
}

/// A minimal identifiable combination of standard parameters.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BaseParameter {
    /// Short name, usually that of the leading standard parameter.
    pub name: String,
    /// Regrouping, e.g. `Izz1 + Ia1 + Iyy2 + 0.2025 (m3 + m4)`.
    pub expression: String,
    /// Unit.
    pub unit: String,
    /// Estimate.
    pub value: Option<f64>,
    /// Standard deviation of the estimate, same unit.
    pub std: Option<f64>,
    /// `100 std / |value|`, %.
    pub relative_std_percent: Option<f64>,
    /// Where the value comes from.
    pub verdict: Option<ParameterVerdict>,
}

/// A parameter of one link or joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StandardParameter {
    /// Link or joint it belongs to.
    pub owner: String,
    /// Name, e.g. `mx`, `Izz`, `fv`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Estimate.
    pub value: Option<f64>,
    /// Standard deviation of the estimate, same unit.
    pub std: Option<f64>,
    /// Value believed before the logs were seen, same unit.
    pub prior: Option<f64>,
    /// Where the value comes from.
    pub verdict: Option<ParameterVerdict>,
}
