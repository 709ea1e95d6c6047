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
pub mod closed_loop;
pub mod consistency;
pub mod cyclic_doubt;
pub mod effort_scale;
pub mod estimate;
pub mod fitting;
mod friction_power;
mod identification;
mod joint_cyclic;
mod joint_stiffness;
mod journal_doubt;
pub mod knowledge;
mod linear_method;
mod load_doubt;
mod load_rounds;
pub mod log_agreement;
pub mod overlap;
mod own_delay;
pub mod passivity;
pub mod pipeline;
pub mod preflight;
mod problem;
pub mod reduction;
mod result;
pub mod searches;
pub mod shape;
pub mod stiffness;
mod structure;
pub mod tie_test;
mod trained_log;
pub mod trust;
pub mod verdict;

pub use dynid_estimate::{advice, prior};
pub use dynid_setup::{
    Error, Fault, Log, Robot, RobotOptions, Settings, VERSION, caution, commands, elements, known_friction,
    log, log_terms, robot, settings,
};
use dynid_setup::{check, finding, input_record, reduction_error, training_log};
pub use estimate::Estimate;
pub use identification::Identification;
pub use joint_cyclic::{JointCyclic, JointSlow};
pub use pipeline::{Step, identify};
