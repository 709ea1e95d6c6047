//! What the result file says about least squares against instruments.

use serde::{Deserialize, Serialize};

dynid_record::words! {
    /// What instruments say of least squares, by the size of the differences.
    BiasVerdict {
        /// Regressors equal instruments.
        Exogenous = "exogenous",
        /// Differences are small.
        Harmless = "harmless",
        /// Differences matter.
        Material = "material",
        /// Instruments say too little of the regressors.
        Weak = "weak",
        /// The simulation that instruments come from diverged.
        Diverged = "diverged",
        /// There is nothing to compare.
        Undetermined = "undetermined",
    }
}

dynid_record::words! {
    /// How the rounds of instruments ended.
    InstrumentEnd {
        /// Parameters no longer changed.
        Settled = "settled",
        /// Rounds ran out.
        Limit = "limit",
        /// The simulation diverged: the fit is that of weighted least squares.
        Diverged = "diverged",
    }
}

/// Least squares against instrumental variables on the training logs.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ExogeneityRecord {
    /// By the size of the differences.
    pub verdict: BiasVerdict,
    /// The verdict in words.
    pub summary: String,
    /// Probability of differences as large by chance, by the jackknife over time blocks; absent without a test.
    pub p_value: Option<f64>,
    /// Probability of differences as large by chance if residuals were independent, which filtered ones are not: it rejects too often.
    pub p_value_independent: Option<f64>,
    /// Time blocks of the test.
    pub blocks: Option<usize>,
    /// Base parameters whose regressor instruments leave something of.
    pub tested: Vec<String>,
    /// Smallest singular value of `Q_ZᵀQ_W`, 0 to 1: cosine of the largest angle between instruments and regressors.
    pub instrument_strength: Option<f64>,
    /// Simulations made with parameters of the first halves of the logs, and of the second.
    pub rounds: [usize; 2],
    /// Largest distance of a simulation from its reference where one diverged, rad or m; absent if it could not go on.
    pub distance: Option<f64>,
    /// Differences, base parameter by base parameter.
    pub parameters: Vec<EffectRecord>,
    /// Instruments of the fit itself; absent for other estimators than `iv`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<InstrumentRecord>,
}

/// One base parameter by least squares and by instruments.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct EffectRecord {
    /// Name of the kept parameter.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Least squares.
    pub least_squares: f64,
    /// Instruments made from the other halves of the logs.
    pub instruments: f64,
    /// Standard deviation of least squares, jackknife over time blocks.
    pub std_least_squares: f64,
    /// Standard deviation of the instruments' value.
    pub std_instruments: f64,
    /// Least squares less instruments.
    pub difference: f64,
    /// Largest difference that is harmless: two standard deviations, or 1 % of the prior deviation.
    pub limit: f64,
    /// Length of what instruments do not explain of the regressor, in parts of its own.
    pub unexplained: f64,
}

/// How the simulations of a fit went.
#[derive(Debug, Clone, Serialize, Deserialize, schemars::JsonSchema)]
pub struct InstrumentRecord {
    /// Simulations made.
    pub rounds: usize,
    /// How the rounds ended.
    pub end: InstrumentEnd,
    /// Largest change of a parameter in the last round.
    pub last_change: Option<f64>,
    /// Of instruments: smallest singular value of `Q_ZᵀQ_W`.
    pub strength: Option<f64>,
    /// Of `didim` and `cloe`, worst output: what they leave of the efforts along the measured motion, in parts of what weighted least squares
    /// leaves.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub residual_ratio: Option<f64>,
    /// Of the same output: how much more that is, as a share of the effort (root of the difference of mean squares).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub effort_share: Option<f64>,
}
