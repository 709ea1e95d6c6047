//! Linear least squares on factors: ordinary, weighted by group, and with a quadratic prior.

mod extended;
mod ols;
mod ridge;
mod wls;

pub use extended::ols_extended;
pub use ols::{LinearSolution, ols};
pub use ridge::{RidgeSolution, ridge};
pub(crate) use wls::merge_weighted;
pub use wls::{GroupVariance, WlsEstimate, WlsSettings, wls};
