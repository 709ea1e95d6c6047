//! Trajectories in files: coefficients (JSON, read and written), samples (CSV, ROS 2 messages; written).

mod coefficients;
mod csv;
mod error;
mod ros;
mod schema;

pub use coefficients::{Leg, TrajectoryFile, TrajectoryJoint};
pub use csv::write_csv;
pub use error::TrajectoryFileError;
pub use ros::{JointTrajectory, write_ros_json, write_ros_yaml};
