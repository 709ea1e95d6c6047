//! Estimated parameters.

pub use dynid_record::{CarriedReason, ParameterVerdict};
use serde::Serialize;

/// A minimal identifiable combination of standard parameters.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BaseParameter {
    /// Short name, usually that of the leading standard parameter.
    pub name: String,
    /// Regrouping, e.g. `Izz1 + Ia1 + Iyy2 + 0.2025 (m3 + m4)`.
    pub expression: String,
    /// Unit.
    pub unit: String,
    /// Estimate, without constraints.
    pub value: Option<f64>,
    /// Standard deviation of the estimate, same unit.
    pub std: Option<f64>,
    /// Half width of the estimate's 95 % interval, same unit.
    pub half_width: Option<f64>,
    /// `100 std / |value|`, %.
    pub relative_std_percent: Option<f64>,
    /// Value of the physically consistent parameters, same unit.
    pub consistent_value: Option<f64>,
    /// Where the value comes from.
    pub verdict: Option<ParameterVerdict>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    pub share: Option<f64>,
}

/// What a standard parameter belongs to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum OwnerKind {
    /// A link.
    #[default]
    Link,
    /// A joint.
    Joint,
}

/// A parameter of one link or joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StandardParameter {
    /// Link or joint it belongs to.
    pub owner: String,
    /// Which of both.
    pub owner_kind: OwnerKind,
    /// Name, e.g. `mx`, `Izz`, `fv`.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value to use.
    pub value: Option<f64>,
    /// Estimate without constraints, same unit.
    pub unconstrained: Option<f64>,
    /// 95 % interval around the unconstrained estimate, lower then upper end, same unit; for what is seen in the data.
    pub interval: Option<[f64; 2]>,
    /// Value believed before the logs were seen, same unit.
    pub prior: Option<f64>,
    /// Where the value comes from.
    pub verdict: Option<ParameterVerdict>,
    /// Why the prior carries it.
    pub reason: Option<CarriedReason>,
    /// Share of the prior variance that the logs remove, 0 to 1.
    pub share: Option<f64>,
    /// Share that any motion of the mechanism could remove, 0 to 1.
    pub possible_share: Option<f64>,
    /// The interval is wide.
    pub wide: bool,
    /// A constraint holds the value.
    pub at_boundary: bool,
    /// What the data see in place of the parameter alone, one sentence; may be empty.
    pub combination: String,
    /// The motion that would help, one sentence; may be empty.
    pub advice: String,
    /// How the parameter follows from others, `j2.fc = j1.fc`; may be empty.
    pub tie: String,
}
