//! Trajectories in files: coefficients (JSON) and samples (CSV), read and written; ROS 2 messages and files for what plays them, written.

mod coefficients;
mod csv;
mod error;
mod playback;
mod ros;
mod samples;
mod schema;

pub use coefficients::{Leg, TrajectoryFile, TrajectoryJoint};
pub use csv::{write_commands, write_csv, write_csv_with_channels};
pub use error::TrajectoryFileError;
pub use playback::Playback;
pub use ros::{JointTrajectory, write_ros_json, write_ros_yaml};
pub use samples::TrajectorySamples;
