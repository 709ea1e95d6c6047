//! Models with fewer base parameters.

use serde::Serialize;

/// Backward elimination of base parameters.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Pruning {
    /// All models, from the whole one down.
    pub path: Vec<PruningStep>,
    /// Number of parameters of the smallest model within one standard error of the least held-out error.
    pub essential: Option<u64>,
    /// Names of its parameters.
    pub essential_parameters: Vec<String>,
    /// Number of parameters of the model of least BIC.
    pub least_bic: Option<u64>,
    /// Number of parameters of the largest model in which every parameter is significant.
    pub all_significant: Option<u64>,
    /// Threshold of that test on [`PruningStep::statistic`].
    pub threshold: Option<f64>,
}

/// One model.
#[derive(Clone, Debug, Default, Serialize)]
pub struct PruningStep {
    /// Number of parameters.
    pub parameters: u64,
    /// Parameter that goes next.
    pub next: String,
    /// Statistic `value^2 / variance` of that parameter.
    pub statistic: Option<f64>,
    /// Bayesian information criterion.
    pub bic: Option<f64>,
    /// Mean squared held-out error in residual variances.
    pub held_out: Option<f64>,
    /// Standard error of the held-out error.
    pub held_out_standard_error: Option<f64>,
}
