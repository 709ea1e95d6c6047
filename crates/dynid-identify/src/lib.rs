//! Arrays in, value out: from a robot, logs as named arrays and settings to an [`Identification`].
//!
//! ```no_run
//! use dynid_identify::{Log, Robot, RobotOptions, Settings, identify};
//! # fn of(arrays: dynid_motion::Log) -> Result<(), dynid_identify::Error> {
//! let robot = Robot::load("arm.urdf".as_ref(), &RobotOptions::default())?;
//! let log = Log::new(&robot, arrays)?;
//! let found = identify(&robot, [log], &Settings::default(), &mut |_| {})?;
//! println!("{}", found.estimate().verdict.headline);
//! # Ok(())
//! # }
//! ```
//!
//! What stands between a fit and parameters that can be trusted is here: the structure of a model, a prior for every parameter, the
//! conditioned fit, bodies that can exist and what they cost, verdicts, intervals and advice, agreement of logs, pre-flight, friction that
//! is passive. No file is opened but those of robots and estimates; `dynid` reads logs and configurations.

pub mod agreement;
pub mod bounds;
pub mod caution;
mod check;
pub mod closed_loop;
pub mod commands;
pub mod consistency;
pub mod cyclic_doubt;
pub mod effort_scale;
pub mod elements;
mod error;
pub mod estimate;
mod finding;
pub mod fitting;
mod friction_power;
mod identification;
mod input_record;

mod joint_cyclic;
mod joint_stiffness;
mod journal_doubt;
pub mod knowledge;
pub mod known_friction;
mod linear_method;
mod load_doubt;
mod load_rounds;
pub mod log;
pub mod log_agreement;
mod log_axis;
pub mod log_terms;
pub mod overlap;
mod own_delay;
pub mod passivity;
mod per_joint;
pub mod pipeline;
pub mod preflight;
mod problem;
pub mod reduction;
mod reduction_error;
mod result;
pub mod robot;
pub mod searches;
pub mod settings;
pub mod shape;
pub mod stiffness;
mod structure;
pub mod tie_test;
mod trained_log;
mod training_log;
pub mod trust;
pub mod verdict;

pub use dynid_estimate::{advice, prior};
pub use error::{Error, Fault};
pub use estimate::Estimate;
pub use identification::Identification;
pub use joint_cyclic::JointCyclic;
pub use log::Log;
pub use pipeline::{Step, identify};
pub use robot::{Robot, RobotOptions};
pub use settings::Settings;

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
