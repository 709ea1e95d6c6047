//! Searches over all bounded parameters of a run.

use std::collections::BTreeMap;

use dynid_search::Algorithm;
use serde::{Deserialize, Serialize};

use crate::Error;

/// Which linear parameters a search moves.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SearchOver {
    /// Base parameters.
    #[default]
    Base,
    /// Standard parameters that act and follow from no other.
    Standard,
}

/// How a residual `r` counts.
#[derive(Debug, Clone, Copy, Default, Deserialize, Serialize, PartialEq, Eq, schemars::JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum SearchLoss {
    /// `|r|`.
    #[default]
    Absolute,
    /// `r²`.
    Squared,
    /// Huber's loss with the threshold 1.345 times the rms residual of least squares, joint by joint.
    Huber,
}

/// Searches over all parameters within bounds, linear and shape parameters together, beside the least-squares answer.
#[derive(Debug, Clone, Default, Deserialize, Serialize, PartialEq)]
#[serde(deny_unknown_fields, default)]
pub struct SearchConfig {
    /// Algorithms: `abc`, `cs`, `ics`, `pso`, `gps`, `cma-es`, `de` (see [`Algorithm`](dynid_search::Algorithm)); at least one.
    pub algorithms: Vec<String>,
    /// Which linear parameters are searched. Default `base`.
    pub over: SearchOver,
    /// How residuals count. Default `absolute`.
    pub loss: SearchLoss,
    /// Weight of a joint's residuals, 1 over its unit of effort to the power of the loss. Default 1.
    pub weights: BTreeMap<String, f64>,
    /// Iterations of a run. Default: the algorithm's own budget.
    pub iterations: Option<u64>,
    /// Evaluations of a run. Default: the algorithm's own budget.
    pub evaluations: Option<u64>,
    /// Size of the population. Default: the algorithm's own.
    pub population: Option<usize>,
    /// Runs of every algorithm, with seeds that count up from the run's. Default 1.
    pub runs: Option<usize>,
    /// Half the width of the bounds of linear parameters about the robot file, in standard deviations of what is known beforehand. Default 3.
    pub range: Option<f64>,
    /// Other bounds `[lower, upper]` of single unknowns, by name, in their unit; of a base parameter by the name of its first term.
    pub bounds: BTreeMap<String, Vec<f64>>,
    /// Most samples, evenly spaced over all logs. Default 2000.
    pub samples: Option<usize>,
}

impl SearchConfig {
    /// The algorithms.
    ///
    /// # Errors
    /// [`Error::Setting`].
    pub fn algorithms(&self) -> Result<Vec<Algorithm>, Error> {
        let known = format!("one of {}", Algorithm::NAMES.join(", "));
        let one = |name: &String| {
            name.parse().map_err(|_| Error::setting("estimator.search.algorithms", &known, name))
        };
        self.algorithms.iter().map(one).collect()
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let key = |name: &str| format!("estimator.search.{name}");
        if self.algorithms.is_empty() {
            return Err(Error::setting(&key("algorithms"), "at least one algorithm", "none"));
        }
        self.algorithms()?;
        let counts = [
            ("iterations", self.iterations),
            ("evaluations", self.evaluations),
            ("population", self.population.map(|n| n as u64)),
            ("runs", self.runs.map(|n| n as u64)),
            ("samples", self.samples.map(|n| n as u64)),
        ];
        if let Some((name, _)) = counts.iter().find(|(_, n)| *n == Some(0)) {
            return Err(Error::setting(&key(name), "at least 1", 0));
        }
        if let Some(x) = self.range.filter(|x| !(x.is_finite() && *x > 0.0)) {
            return Err(Error::setting(&key("range"), "a positive number", x));
        }
        let fits = |range: &Vec<f64>| matches!(range[..], [low, high] if low <= high && low.is_finite() && high.is_finite());
        if let Some((name, range)) = self.bounds.iter().find(|(_, range)| !fits(range)) {
            let expected = "[lower, upper], finite and in this order";
            return Err(Error::setting(&key(&format!("bounds.{name}")), expected, format!("{range:?}")));
        }
        match self.weights.iter().find(|(_, x)| !(x.is_finite() && **x >= 0.0)) {
            Some((joint, x)) => {
                Err(Error::setting(&key(&format!("weights.{joint}")), "a number that is not negative", x))
            }
            None => Ok(()),
        }
    }
}
