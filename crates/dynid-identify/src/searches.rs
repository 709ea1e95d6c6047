//! What searches over all bounded parameters found, beside the least-squares answer.

use serde::{Deserialize, Serialize};

use crate::settings::{SearchLoss, SearchOver};

dynid_record::words! {
    /// How a search ended.
    SearchEnd {
        /// All iterations or evaluations are used.
        BudgetUsed = "budget used",
        /// The algorithm would not move any more.
        Converged = "converged",
        /// Any other way.
        Stopped = "stopped",
    }
}

/// One run of an algorithm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SearchRun {
    /// Seed.
    pub seed: u64,
    /// Loss of the best point.
    pub value: f64,
    /// Evaluations.
    pub evaluations: u64,
    /// How it ended.
    pub end: SearchEnd,
    /// Best loss so far against evaluations.
    pub history: Vec<(u64, f64)>,
}

/// What one algorithm found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SearchedBy {
    /// Algorithm.
    pub algorithm: String,
    /// Loss of the best run.
    pub value: f64,
    /// Median loss over the runs.
    pub median: f64,
    /// Runs in the order of their seeds.
    pub runs: Vec<SearchRun>,
    /// Unknowns at the best point, in the order of [`Searches::unknowns`].
    pub point: Vec<f64>,
    /// Wall time of all runs, s; no part of result files, which depend on inputs and settings alone.
    #[serde(skip)]
    pub seconds: f64,
}

/// Searches of one identification, by rising loss.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Searches {
    /// Linear parameters that were searched.
    pub over: SearchOver,
    /// How residuals count.
    pub loss: SearchLoss,
    /// Unknowns: names of linear parameters (base parameters by their first), then of shape parameters.
    pub unknowns: Vec<String>,
    /// Bounds of the unknowns.
    pub bounds: Vec<(f64, f64)>,
    /// Samples behind a loss.
    pub samples: usize,
    /// Loss of the least-squares answer on the same samples.
    pub least_squares: f64,
    /// Unknowns of the least-squares answer.
    pub least_squares_point: Vec<f64>,
    /// Unknowns for which the least-squares answer lies outside the bounds.
    pub outside: Vec<String>,
    /// What the algorithms found, the least loss first.
    pub found: Vec<SearchedBy>,
}
