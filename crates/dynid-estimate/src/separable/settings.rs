//! Settings and errors of separable fits.

use crate::linear::{IrlsSettings, LinearError, VarianceSharing, WlsSettings};
use dynid_search::{self as search, Algorithm, SearchError};

/// Loss of the residuals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SeparableLoss {
    /// `Σ r²`.
    #[default]
    Squares,
    /// Huber's loss, quadratic up to [`IrlsSettings::huber`] scales and linear beyond.
    Huber,
    /// `Σ |r|`. Its estimate comes without a covariance: fit by squares or Huber's loss for intervals.
    Absolute,
}

/// Which residual variances groups of rows have.
#[derive(Debug, Clone, PartialEq)]
pub enum Weighting {
    /// One variance for all rows: plain sums over residuals in the unit of effort.
    Equal,
    /// Residual variances found with the parameters, as [`crate::linear::wls`] does.
    Groups {
        /// Which groups share a variance.
        sharing: VarianceSharing,
        /// Iteration of the variances.
        wls: WlsSettings,
    },
}

impl Default for Weighting {
    fn default() -> Self {
        Weighting::Groups { sharing: VarianceSharing::default(), wls: WlsSettings::default() }
    }
}

/// A search of shape parameters over the whole box, linear parameters eliminated; its best point is where the fit
/// starts. The objective is the weighted residual sum of squares.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeSearch {
    /// Algorithm.
    pub algorithm: Algorithm,
    /// Budget and seed; a start is taken from the problem where none is given.
    pub settings: search::Settings,
}

/// Settings of [`super::fit`].
#[derive(Debug, Clone, PartialEq)]
pub struct SeparableSettings {
    /// Loss. Default [`SeparableLoss::Squares`].
    pub loss: SeparableLoss,
    /// Residual variances. Default [`Weighting::Groups`].
    pub weighting: Weighting,
    /// Starts, the given one among them. Default 20; 1: the given start alone.
    pub starts: usize,
    /// Seed of the starts that are neither corners nor centre. Default 0.
    pub seed: u64,
    /// Finds the one start by this search in place of the multi-start; it needs finite bounds. Default none.
    pub search: Option<ShapeSearch>,
    /// Most iterations from one start. Default 200.
    pub max_iterations: usize,
    /// Stop when no shape parameter moves by more than this share of its value. Default 1e-10.
    pub step_tolerance: f64,
    /// Stop when `|J_kᵀ r| < tolerance ‖J_k‖ ‖r‖` for every free parameter. Default 1e-8.
    pub gradient_tolerance: f64,
    /// Points of a profile between the bounds. Default 15; 0: no profiles, every shape counts as seen.
    pub profile_points: usize,
    /// Rise of the loss in units of the residual variance that counts as seen; times the variance inflation.
    /// Default 3.84, the 95 % quantile of χ² with one degree of freedom.
    pub profile_rise: f64,
    /// Hold shape parameters that are not seen at their start. Default true; false: they keep the value of the least loss,
    /// which noise has chosen.
    pub hold_unseen: bool,
    /// Robust losses.
    pub irls: IrlsSettings,
}

impl Default for SeparableSettings {
    fn default() -> Self {
        SeparableSettings {
            loss: SeparableLoss::Squares,
            weighting: Weighting::default(),
            starts: 20,
            seed: 0,
            search: None,
            max_iterations: 200,
            step_tolerance: 1e-10,
            gradient_tolerance: 1e-8,
            profile_points: 15,
            profile_rise: 3.84,
            hold_unseen: true,
            irls: IrlsSettings::default(),
        }
    }
}

/// Why there is no separable fit.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SeparableError {
    /// No group has a row.
    #[error("no rows to fit")]
    NoRows,
    /// Bounds that leave nothing between them.
    #[error("shape parameter `{name}`: expected lower <= upper bound, found {lower} and {upper}")]
    Bounds {
        /// Parameter.
        name: String,
        /// Lower bound.
        lower: f64,
        /// Upper bound.
        upper: f64,
    },
    /// A start that is no number.
    #[error("shape parameter `{name}`: expected a finite start, found {found}")]
    Start {
        /// Parameter.
        name: String,
        /// Start given.
        found: f64,
    },
    /// A logarithmic scale that would reach zero.
    #[error(
        "shape parameter `{name}`: a logarithmic scale needs positive values, found lower bound {lower}, start {start}"
    )]
    Logarithm {
        /// Parameter.
        name: String,
        /// Lower bound.
        lower: f64,
        /// Start.
        start: f64,
    },
    /// A list of the wrong length, or an index that does not exist.
    #[error("group {group}: {what}: expected {expected}, found {found}")]
    Size {
        /// Group of rows.
        group: usize,
        /// What was counted.
        what: &'static str,
        /// What it should be.
        expected: usize,
        /// What it is.
        found: usize,
    },
    /// A value is NaN or infinite.
    #[error("group {group}, row {row}, {}: expected a finite number, found {found}", column_name(*column))]
    NotFinite {
        /// Group of rows.
        group: usize,
        /// Linear parameter of the column, `None` for the effort.
        column: Option<usize>,
        /// Row of the group.
        row: usize,
        /// The value.
        found: f64,
    },
    /// The shaped columns are not finite at any start.
    #[error("the model is not finite at any of {starts} starts")]
    NotFiniteAnywhere {
        /// Starts tried.
        starts: usize,
    },
    /// The search cannot run.
    #[error("search: {0}")]
    Search(#[from] SearchError),
    /// The covariance cannot be formed.
    #[error(transparent)]
    Linear(#[from] LinearError),
}

fn column_name(column: Option<usize>) -> String {
    column.map_or_else(|| "effort".to_owned(), |c| format!("column of linear parameter {c}"))
}
