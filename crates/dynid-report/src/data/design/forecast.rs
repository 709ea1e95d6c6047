//! What the log of the trajectory will tell.

use serde::Serialize;

/// Criterion and condition of the designed trajectory.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignQuality {
    /// Criterion as the search saw it: on its grid, with smoothed signs of velocity.
    pub criterion_search: Option<f64>,
    /// Criterion with exact signs on the report's samples.
    pub criterion_exact: Option<f64>,
    /// Largest singular value of the weighted observation matrix.
    pub sigma_largest: Option<f64>,
    /// Smallest singular value of the weighted observation matrix.
    pub sigma_smallest: Option<f64>,
    /// Condition number of the weighted columns in SI units.
    pub condition: Option<f64>,
    /// Condition number of columns of unit length.
    pub condition_unit_norm: Option<f64>,
}

/// What random motion within the same limits and of the same length would give.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RandomMotion {
    /// Random trajectories compared with.
    pub trajectories: Option<u64>,
    /// Arithmetic mean over the parameters of `std(random) / std(designed)`, median over the trajectories.
    pub mean_ratio: Option<f64>,
    /// Geometric mean likewise.
    pub geometric_ratio: Option<f64>,
    /// Median condition number, columns in SI units.
    pub condition: Option<f64>,
}

/// A parameter and how well the log will show it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignParameter {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value the design was made with.
    pub nominal: Option<f64>,
    /// Predicted standard deviation, same unit.
    pub std: Option<f64>,
    /// `100 std / |nominal|`, %.
    pub relative_std_percent: Option<f64>,
}

/// The 95 % interval of a parameter by the logs so far, and by these and the motion.
#[derive(Clone, Debug, Default, Serialize)]
pub struct IntervalForecast {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value by the logs so far.
    pub value: Option<f64>,
    /// Half width by the logs so far.
    pub before: Option<f64>,
    /// Half width that is wanted; `None` for other parameters.
    pub wanted: Option<f64>,
    /// Half width that logs and motion are expected to give together.
    pub after: Option<f64>,
    /// What comes of what is wanted, e.g. `reached`; empty for other parameters.
    pub state: String,
    /// Whether what is wanted will not be there.
    pub is_missed: bool,
    /// What there is to say of it.
    pub note: String,
}

/// Two parameters whose estimates will be strongly correlated.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ConfoundedPair {
    /// Names.
    pub names: [String; 2],
    /// Predicted correlation of the estimates, -1 to 1.
    pub correlation: Option<f64>,
}

/// Share of one parameter in a combination.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ParameterShare {
    /// Name.
    pub name: String,
    /// Squared component along the combination's unit vector (columns of unit length), 0 to 1.
    pub share: Option<f64>,
}
