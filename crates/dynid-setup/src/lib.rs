//! What an identification is given: a robot with elements by name, logs as named arrays, settings; and the words for what is wrong with them.
//!
//! No file is opened but those of robots.

pub mod caution;
pub mod check;
pub mod commands;
pub mod elements;
mod error;
pub mod finding;
pub mod input_record;
pub mod known_friction;
pub mod log;
pub mod log_axis;
pub mod log_terms;
pub mod per_joint;
pub mod reduction_error;
pub mod robot;
pub mod settings;
pub mod training_log;

pub use dynid_estimate::prior;
pub use error::{Error, Fault};
pub use log::Log;
pub use robot::{Robot, RobotOptions};
pub use settings::Settings;

/// Version of the program.
pub const VERSION: &str = env!("CARGO_PKG_VERSION");
