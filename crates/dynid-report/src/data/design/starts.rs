//! Ends of the search's starts.

use serde::Serialize;

/// The starts of the search.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Starts {
    /// Starts asked for; more than `outcomes` when a time budget ended the search.
    pub asked: Option<u64>,
    /// Criterion up to which a start counts as ending within 5 % of the best.
    pub near_best: Option<f64>,
    /// Starts that ran, by seed.
    pub outcomes: Vec<DesignStart>,
}

/// End of one start.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignStart {
    /// Seed of the start.
    pub seed: u64,
    /// Criterion with exact signs, on the scale of [`super::DesignQuality::criterion_exact`]; `None` if undefined.
    pub criterion: Option<f64>,
    /// All limits hold.
    pub feasible: bool,
}
