//! SDF, the format of Gazebo: reading.

mod document;
mod frames;
mod joint;
mod pose;
mod read;

pub use read::{parse, parse_model};
