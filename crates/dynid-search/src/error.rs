//! Errors of searches.

use thiserror::Error;

use super::bounds::BoundsError;
use super::checkpoint::CheckpointError;

/// Why a search cannot be run.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SearchError {
    /// The bounds are refused.
    #[error(transparent)]
    Bounds(#[from] BoundsError),
    /// Objective and bounds are of different dimensions.
    #[error("bounds of {found} coordinates, expected {expected} as the objective has")]
    Dimensions {
        /// Coordinates of the objective.
        expected: usize,
        /// Coordinates of the bounds.
        found: usize,
    },
    /// The algorithm draws from the whole box and a coordinate is not bounded on both sides.
    #[error(
        "{algorithm} draws points from the whole box, but coordinate {index} is not bounded on both sides"
    )]
    Unbounded {
        /// Name of the algorithm.
        algorithm: &'static str,
        /// The coordinate, from 0.
        index: usize,
    },
    /// A budget of nothing.
    #[error("a budget of 0 {what}, expected at least 1")]
    NoBudget {
        /// What there is none of: `iterations` or `evaluations`.
        what: &'static str,
    },
    /// The target is not a number.
    #[error("the target value is not a number")]
    Target,
    /// Too small a population.
    #[error("{algorithm} needs a population of at least {expected}, found {found}")]
    Population {
        /// Name of the algorithm.
        algorithm: &'static str,
        /// Least size.
        expected: usize,
        /// Size asked for.
        found: usize,
    },
    /// A parameter of the algorithm out of its range.
    #[error("{algorithm}: {parameter} is {found}, expected {expected}")]
    Parameter {
        /// Name of the algorithm.
        algorithm: &'static str,
        /// The parameter.
        parameter: &'static str,
        /// Range that is allowed.
        expected: &'static str,
        /// Value that is found.
        found: f64,
    },
    /// The start point has another number of coordinates.
    #[error("a start point of {found} coordinates, expected {expected}")]
    StartLength {
        /// Coordinates of the bounds.
        expected: usize,
        /// Coordinates of the start.
        found: usize,
    },
    /// The start point is not within the bounds.
    #[error("coordinate {index}: start {value} is not within {lower} to {upper}")]
    StartOutside {
        /// The coordinate, from 0.
        index: usize,
        /// Value of the coordinate.
        value: f64,
        /// Lower bound of the coordinate.
        lower: f64,
        /// Upper bound of the coordinate.
        upper: f64,
    },
    /// No algorithm of this name.
    #[error("no search algorithm `{name}`; known are {}", known.join(", "))]
    UnknownAlgorithm {
        /// The name asked for.
        name: String,
        /// The names that are known.
        known: &'static [&'static str],
    },
    /// None of the points that were tried has a finite value.
    #[error("the objective was finite at none of {evaluations} points")]
    NowhereFinite {
        /// Evaluations made.
        evaluations: u64,
    },
    /// The checkpoint is refused.
    #[error(transparent)]
    Checkpoint(#[from] CheckpointError),
}
