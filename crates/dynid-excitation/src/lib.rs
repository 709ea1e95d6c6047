//! Optimal excitation trajectories within all limits, and circles of a point in task space.
//!
//! [`RobotExcitation`] is for logs of motion and effort, [`ServoExcitation`] for those of commands and positions, [`ClosedExcitation`] for
//! mechanisms with loops.

mod closed;
pub mod constraint;
pub mod criterion;
mod design;
mod duals;
pub mod envelope;
mod evaluation;
mod feasibility;
mod forecast;
mod grid;
mod model;
mod optimiser;
mod parametrisation;
mod problem;
mod random;
mod restoration;
mod robot;
mod search;
mod servo;
mod start;
mod task_space;

pub use closed::{ClosedExcitation, TiedColumn};
pub use design::{Design, Outcome, Settings, StartOutcome, design};
pub use duals::{DualConstraint, DualMap, DualModel, DualState};
pub use dynid_motion::trajectory::MotionLimits;
pub use evaluation::{Information, criterion_gradient, information, limit_points};
pub use feasibility::{Blame, Infeasible, LimitKind, LimitPoint};
pub use forecast::{ColumnForecast, ConfoundedPair, Forecast, RandomComparison, forecast, forecast_by};
pub use model::{ColumnInfo, ExcitationModel, Sensitivity};
pub use parametrisation::{Parametrisation, StartConditions};
pub use problem::{DEFAULT_SAMPLES_PER_HARMONIC, DEFAULT_SIGN_WIDTH, Problem, ProblemError};
pub use random::random_trajectory;
pub use robot::RobotExcitation;
pub use servo::{PositionLoop, ServoColumn, ServoExcitation};
pub use task_space::{CircleSettings, PointCircle, TaskSpaceError};
