//! What the result file says about consistency, precision and essential parameters.

use dynid_record::{Basis, ConsistencyForm, ConsistencyStatus, PriorDistance};
use serde::{Deserialize, Serialize};

use super::LogFit;

/// Physical consistency.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ConsistencyRecord {
    /// Which bodies count as such that can exist.
    pub form: ConsistencyForm,
    /// How the search ended.
    pub status: ConsistencyStatus,
    /// What consistency costs in fit: increase of the weighted sum of squares, in residual variances.
    pub price: f64,
    /// Increase of the weighted sum of squares over what the same number of parameters would take up by chance, `price / (variance inflation ·
    /// base parameters)`; around 1 is no more than noise.
    pub price_over_chance: Option<f64>,
    /// How the distance from the robot file is measured, as given or as held-out folds have it.
    pub prior: PriorDistance,
    /// Weight of that distance, as given or as large as held-out folds allow.
    pub prior_weight: f64,
    /// All that were tried.
    pub prior_trials: Vec<PriorTrialRecord>,
    /// No consistent parameters (with whitened sizes up to ten times these) have an objective lower by more than this.
    pub gap: f64,
    /// Iterations of the interior-point method.
    pub iterations: usize,
    /// Least eigenvalue of the links' pseudo-inertias in units of the prior's; at least 1e-6. `None` without links.
    pub least_eigenvalue: Option<f64>,
    /// Constraints that hold the estimate back, in words.
    pub active: Vec<String>,
    /// Figures of the parameters without constraints on the training logs; empty where they predict the same.
    pub training_unconstrained: Vec<LogFit>,
    /// Figures of the parameters without constraints on the validation logs.
    pub validation_unconstrained: Vec<LogFit>,
}

/// A distance from the robot file and its weight, with what they do on held-out folds.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PriorTrialRecord {
    /// How the distance is measured.
    pub prior: PriorDistance,
    /// Its weight, residual variances per squared deviation or per nat.
    pub weight: f64,
    /// Squared held-out error relative to that without constraints (mean over joints); null where nothing was held out.
    pub loss: Option<f64>,
}

/// Errors on held-out folds of time of the training logs, rows as the fit sees them.
#[derive(Debug, Clone, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub struct HeldOutRecord {
    /// Number of folds.
    pub folds: usize,
    /// RMS per joint, in the effort's unit, without constraints.
    pub rms: Vec<Option<f64>>,
    /// Standard error of the RMS over the folds.
    pub rms_standard_error: Vec<Option<f64>>,
    /// RMS per joint of the physically consistent estimate.
    pub rms_consistent: Vec<Option<f64>>,
    /// `100 ‖residual‖ / ‖effort‖` over all joints without constraints, percent.
    pub relative_error: Option<f64>,
    /// `100 ‖residual‖ / ‖effort‖` of the physically consistent estimate, percent.
    pub relative_error_consistent: Option<f64>,
}

/// What the residuals say about the standard deviations.
#[derive(Debug, Clone, Default, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PrecisionRecord {
    /// By how much coloured residuals inflate the variances that white ones would give (median over base parameters; of fewer than ten
    /// time blocks one number for all, from their scores).
    pub variance_inflation: f64,
    /// Variance inflation per joint.
    pub variance_inflation_per_joint: Vec<Option<f64>>,
    /// What the standard deviations rest on; absent from files of earlier versions: time blocks.
    #[serde(default)]
    pub basis: Basis,
    /// Number of time blocks behind the standard deviations, or of robots.
    pub blocks: usize,
    /// Length of the time blocks, s; of robots, of the logs of one on the average.
    pub block_s: f64,
    /// Length that the correlation of the residuals asks for, s.
    pub wanted_block_s: f64,
    /// Correlation time of the residuals, s: per training log and joint, log after log.
    #[serde(default)]
    pub correlation_s: Vec<Option<f64>>,
    /// Per training log and joint: test of whiteness inside the band of the kernel.
    pub whiteness: Vec<Vec<Option<WhitenessRecord>>>,
}

/// Cumulative periodogram test.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct WhitenessRecord {
    /// Largest distance from a straight line.
    pub distance: f64,
    /// Threshold at 5 %.
    pub threshold: f64,
    /// White noise is rejected.
    pub rejected: bool,
    /// Frequency of the largest peak, Hz.
    pub dominant_hz: f64,
}

/// Backward elimination of base parameters.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PruningRecord {
    /// All models, from the whole one down to one parameter.
    pub path: Vec<PruningStep>,
    /// Number of parameters of the smallest model within one standard error of the least held-out error.
    pub essential: Option<usize>,
    /// Names of its parameters.
    pub essential_parameters: Vec<String>,
    /// Number of parameters of the model of least BIC.
    pub least_bic: usize,
    /// Number of parameters of the first model in which every parameter is significant.
    pub all_significant: Option<usize>,
    /// Threshold of that test.
    pub threshold: f64,
}

/// One model of a backward elimination.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PruningStep {
    /// Number of parameters.
    pub parameters: usize,
    /// Parameter that goes next.
    pub next: String,
    /// Test statistic of that parameter, `value² / variance`.
    pub statistic: Option<f64>,
    /// Weighted residual sum of squares.
    pub rss: f64,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
    /// Mean held-out squared error in residual variances.
    pub held_out: Option<f64>,
    /// Standard error of the held-out error.
    pub held_out_standard_error: Option<f64>,
}
