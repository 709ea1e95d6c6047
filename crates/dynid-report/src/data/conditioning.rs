//! How the logs were conditioned and how well posed the estimate is.

pub use dynid_record::Origin;
use serde::Serialize;

use super::Value;

/// A setting as it was used.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Chosen {
    /// Name of the setting, with its joint if it is one joint's.
    pub name: String,
    /// Value used.
    pub value: Value,
    /// Unit of `value`.
    pub unit: String,
    /// Who decided.
    pub origin: Origin,
    /// Why this value.
    pub reason: String,
}

impl Chosen {
    /// A setting that the user gave.
    pub fn given(name: impl Into<String>, value: impl Into<Value>, unit: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            value: value.into(),
            unit: unit.into(),
            origin: Origin::Given,
            reason: String::new(),
        }
    }
}

/// Candidate values of one setting and their losses.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Ladder {
    /// Title, e.g. `Mask around velocity reversal, joint_2`.
    pub title: String,
    /// How the losses were computed and the choice made; may be empty.
    pub explanation: String,
    /// What varies, e.g. `half width`.
    pub quantity: String,
    /// Unit of what varies.
    pub unit: String,
    /// Name of the loss, e.g. `held-out RMS`.
    pub loss_name: String,
    /// Unit of the loss.
    pub loss_unit: String,
    /// Candidates in the order tried.
    pub rungs: Vec<Rung>,
}

/// One candidate.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Rung {
    /// The candidate.
    pub value: Value,
    /// Loss of the candidate.
    pub loss: Option<f64>,
    /// Standard error of the loss, same unit.
    pub loss_std_error: Option<f64>,
    /// Samples it keeps, %.
    pub kept_percent: Option<f64>,
    /// Whether it was chosen.
    pub chosen: bool,
}

/// Delay of one joint's effort behind its position.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointDelay {
    /// Estimated delay, s; positive when the effort comes late.
    pub delay_s: Option<f64>,
    /// 95 % interval of the delay, s, lower then upper.
    pub interval_s: Option<[f64; 2]>,
    /// Delay that was compensated before estimation, s.
    pub applied_s: Option<f64>,
}

/// The observation matrix W that the estimate rests on.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Observation {
    /// Rows (samples times joints, after conditioning).
    pub rows: Option<u64>,
    /// Columns (standard parameters).
    pub columns: Option<u64>,
    /// Numerical rank, the number of base parameters that these logs excite.
    pub rank: Option<u64>,
    /// Rank for random motion of the same mechanism, the number of base parameters it has.
    pub structural_rank: Option<u64>,
    /// Relative threshold on the scaled singular values or pivots below which a direction counts as unexcited.
    pub rank_tolerance: Option<f64>,
    /// Condition number of the base columns of W as they are, in SI units.
    pub condition_number: Option<f64>,
    /// Condition number after scaling each column to unit norm.
    pub condition_number_scaled: Option<f64>,
}

/// A column that no motion of this mechanism excites.
#[derive(Clone, Debug, Default, Serialize)]
pub struct UnidentifiableColumn {
    /// Standard parameter.
    pub name: String,
    /// Why; may be empty.
    pub reason: String,
}
