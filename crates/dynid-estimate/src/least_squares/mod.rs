//! Solutions of factors: least squares, ordinary, weighted by group and with a quadratic prior; total least squares.

mod ols;
mod ridge;
mod tls;
mod wls;

pub use ols::{LinearSolution, ols, ols_values};
pub use ridge::{RidgeSolution, ridge};
pub(crate) use tls::{ColumnErrors, tls_groups};
pub use tls::{TlsNoise, TlsRefusal, TlsSolution, tls};
pub use wls::{GroupVariance, WlsEstimate, WlsSettings, wls};
pub(crate) use wls::{PriorRows, floors, group_floors, merge_weighted, wls_with};
