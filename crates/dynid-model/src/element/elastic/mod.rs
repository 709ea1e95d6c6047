//! Joints with an elastic transmission: harmonic drives.

mod cubic_spring;
mod piecewise;
mod transmission;

pub use cubic_spring::CubicSpring;
pub use piecewise::{CubicFit, PiecewiseFit, PiecewiseSpring};
pub use transmission::{ElasticDoubt, ElasticTransmission};
