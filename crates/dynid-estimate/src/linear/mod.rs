//! Linear least squares on factors: ordinary, weighted by group, with a quadratic prior, and total.

mod difference;
mod estimate;
mod extended;
mod irls;
mod linear_estimate;
mod method;
mod ols;
mod ridge;
mod tls;
mod wls;

pub use difference::{DifferenceFit, explain_difference};
pub(crate) use estimate::assemble;
pub use estimate::estimate;
pub use extended::ols_extended;
pub(crate) use irls::robust_scales;
pub use linear_estimate::{GroupFit, LinearEstimate};
pub use method::{IrlsSettings, LinearError, LinearMethod, LinearSettings, VarianceSharing};
pub use ols::{LinearSolution, ols};
pub use ridge::{RidgeSolution, ridge};
pub use tls::{TlsNoise, TlsRefusal, TlsSolution, tls};
pub use wls::{GroupVariance, WlsEstimate, WlsSettings, wls};
pub(crate) use wls::{floors, group_floors, merge_weighted};
