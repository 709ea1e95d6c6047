//! Physical consistency and its price, errors on held-out parts of the training logs.

pub use dynid_record::{ConsistencyForm, ConsistencyStatus};
use serde::Serialize;

use super::OwnerKind;

/// Physical consistency of the standard parameters.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Consistency {
    /// What was asked for.
    pub form: Option<ConsistencyForm>,
    /// How the search ended.
    pub status: Option<ConsistencyStatus>,
    /// Increase of the weighted sum of squares over the unconstrained fit, in residual variances.
    pub price: Option<f64>,
    /// Increase of the weighted sum of squares over what the same number of parameters would take up by chance.
    pub price_over_chance: Option<f64>,
    /// Weight of the distance from the prior.
    pub prior_weight: Option<f64>,
    /// Certified gap: no consistent parameters have an objective lower by more than this, in residual variances.
    pub gap: Option<f64>,
    /// Least eigenvalue of the links' pseudo-inertias in units of the prior's.
    pub least_eigenvalue: Option<f64>,
    /// Constraints that hold the estimate back.
    pub limits: Vec<Limit>,
    /// Relative error on validation logs with and without constraints; empty where no constraint matters.
    pub validation: Vec<ValidationPrice>,
}

/// A constraint that holds the estimate back.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Limit {
    /// Link or joint it acts on; empty for a bound on several.
    pub owner: String,
    /// Which of both.
    pub owner_kind: OwnerKind,
    /// The constraint in words, e.g. `no thickness along its x axis`.
    pub text: String,
}

/// `100 |residual| / |effort|` of one validation log over all joints, equally filtered, with and without constraints.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ValidationPrice {
    /// Name of the log.
    pub log: String,
    /// Without constraints, %.
    pub free_percent: Option<f64>,
    /// Of the consistent parameters, %.
    pub consistent_percent: Option<f64>,
}

/// Errors on held-out folds of the training logs: each fold predicted from a fit to the others.
#[derive(Clone, Debug, Default, Serialize)]
pub struct HeldOut {
    /// Number of folds; 0 if nothing was held out.
    pub folds: u64,
    /// Per joint.
    pub joints: Vec<HeldOutJoint>,
    /// `100 |residual| / |effort|` over all joints without constraints, %.
    pub free_percent: Option<f64>,
    /// `100 |residual| / |effort|` of the consistent parameters, %.
    pub consistent_percent: Option<f64>,
}

/// Held-out error of one joint, RMS in its effort unit.
#[derive(Clone, Debug, Default, Serialize)]
pub struct HeldOutJoint {
    /// Without constraints.
    pub free: Option<f64>,
    /// Standard error of that over the folds.
    pub standard_error: Option<f64>,
    /// Of the consistent parameters.
    pub consistent: Option<f64>,
}
