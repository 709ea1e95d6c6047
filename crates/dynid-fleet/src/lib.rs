//! Many robots of one type from the factors of their logs: what they share, how each differs, which logs and robots stand out, and what
//! changes with time.
//!
//! Rows of log `l` of robot `r`: `y = W_f (f + b_r + c_l + Γ u_l) + W_β β + e` with `b_r ~ N(0, D_b)`, `c_l ~ N(0, D_c)`, covariates `u_l`.
//!
//! | question | item |
//! |---|---|
//! | logs as factors, robots, what varies | [`Fleet`] |
//! | parameters of type, robots and logs, with spreads | [`fit()`], [`FleetFit`] |
//! | what is known of a robot before its first log | [`FleetFit::new_robot`] |
//! | by how much logs differ in what they are free to differ in | [`FleetFit::differences`] |
//! | what each robot says of the type, for any estimator | [`FleetFit::said_by_robots`] |
//! | robots and logs out of the spread | [`FleetFit::robot_outliers`], [`FleetFit::log_outliers`] |
//! | changes with dates | [`drift()`](drift::drift) |
//! | robots that have changed, as they are now | [`FleetFit::robots_now`] |
//! | parts merged to the same bits in any order | [`tree`] |
//!
//! The result depends on the set of logs only: not on their order, nor on the number of threads.

mod colour;
mod data;
mod differences;
pub mod drift;
mod fit;
mod jackknife;
mod noise;
mod now;
mod of_type;
mod outliers;
mod split;
mod spread;
mod sweep;
pub mod tree;
mod triangle;
mod variances;

pub use data::{ChannelFactor, Coordinate, FEW, Fleet, FleetError, FleetLog};
pub use differences::{LEAST_HALVED, LogDifference, LogHalves};
pub use fit::{Expected, FitSettings, FleetFit, LogFit, RobotFit, fit, fit_at, variances_at};
pub use noise::Noise;
pub use outliers::Outlier;
pub use spread::{LEFT_OUT, Variances};
pub use variances::{Settled, VarianceSettings};
