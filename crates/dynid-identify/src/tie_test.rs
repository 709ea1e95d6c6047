//! What logs say of ties.

use serde::{Deserialize, Serialize};

/// A relation of a tie, as the logs have it with every parameter free.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct TieDeviation {
    /// The relation: `j2.fc = j1.fc`.
    pub tie: String,
    /// Left side less right side, in the parameter's unit.
    pub value: f64,
    /// Standard deviation of that.
    pub std: f64,
    /// Unit.
    pub unit: String,
}

/// The fit with ties against the fit without.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct TieTest {
    /// Fall of the residual sum of squares per parameter that ties hold, over the variance of the residual without ties, its colour
    /// counted: around 1 where the ties are right.
    pub f: f64,
    /// Value that 99 % of fits with right ties stay below.
    pub limit: f64,
    /// Combinations of parameters that the ties hold and the logs would show.
    pub held: usize,
    /// Share of the weighted residual that goes with the ties, 0 to 1.
    pub relief: f64,
    /// Relations that the logs contradict (1 % for all together), the surest first.
    pub deviations: Vec<TieDeviation>,
}

impl TieTest {
    /// Whether the logs bear the ties out.
    pub fn is_borne_out(&self) -> bool {
        self.f <= self.limit
    }
}
