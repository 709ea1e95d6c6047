//! Position-controlled drives whose effort nobody measures.
pub mod chain;
pub mod fit;
mod free;
pub mod identify;
mod joint;
mod log;
mod rollout;
mod settings;
pub mod start;
mod step;
mod term;

pub use chain::Chain;
pub use free::{Free, ServoValues, Target};
pub use joint::{Hold, Limited, LoadOf, Scheme, ServoJoint};
pub use log::ServoLog;
pub use rollout::{Count, Lost, Rollout, SimulatedRow};
pub use settings::{Addition, Choice, ServoSettings, Shared};
pub use term::Term;
