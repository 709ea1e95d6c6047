//! Linear least squares on factors: ordinary, weighted by group, with a quadratic prior, and total.

mod difference;
mod estimate;
mod irls;
mod linear_estimate;
mod method;
mod own;
mod row_scores;

pub use difference::{DifferenceFit, explain_difference};
pub(crate) use estimate::assemble;
pub use estimate::{estimate, of_unit_variance};
pub(crate) use irls::robust_scales;
pub use linear_estimate::{GroupFit, LinearEstimate};
pub use method::{IrlsSettings, LinearError, LinearMethod, LinearSettings, VarianceSharing};
pub use own::{OwnEstimator, OwnFit};
pub use row_scores::{RowScores, row_scores};

pub use crate::least_squares::{
    GroupVariance, LinearSolution, RidgeSolution, TlsNoise, TlsRefusal, TlsSolution, WlsEstimate,
    WlsSettings, ols, ols_values, ridge, tls, wls,
};
