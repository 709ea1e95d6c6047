//! Many robots of one type from the factors of their logs: what they share, how each differs, which logs and robots stand out, and what
//! changes with time.

mod colour;
mod data;
pub mod drift;
mod fit;
mod jackknife;
mod noise;
mod outliers;
mod split;
mod sweep;
pub mod tree;
mod triangle;
mod variances;

pub use data::{ChannelFactor, Coordinate, FEW, Fleet, FleetError, FleetLog};
pub use fit::{Expected, FitSettings, FleetFit, LogFit, RobotFit, fit, fit_at, variances_at};
pub use noise::Noise;
pub use outliers::Outlier;
pub use variances::{LEFT_OUT, Settled, VarianceSettings, Variances};
