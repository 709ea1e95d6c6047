//! Position-controlled drives whose effort nobody measures.
pub mod chain;
pub mod fit;
mod free;
mod joint;
mod log;
mod rollout;
pub mod start;
mod step;
mod term;

pub use chain::Chain;
pub use free::{Free, ServoValues, Target};
pub use joint::{Hold, Limited, LoadOf, Scheme, ServoJoint};
pub use log::ServoLog;
pub use rollout::{Count, Lost, Rollout, SimulatedRow};
pub use term::Term;
