//! Linear least squares on factors: ordinary, weighted by group, with a quadratic prior, and total.

mod extended;
mod ols;
mod ridge;
mod tls;
mod wls;

pub use extended::ols_extended;
pub use ols::{LinearSolution, ols};
pub use ridge::{RidgeSolution, ridge};
pub use tls::{TlsNoise, TlsRefusal, TlsSolution, tls};
pub(crate) use wls::merge_weighted;
pub use wls::{GroupVariance, WlsEstimate, WlsSettings, wls};
