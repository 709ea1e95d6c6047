//! Mechanism trees: inverse and forward dynamics, regressors, kinematics and their slopes.
//!
//! A [`Description`] (what a robot file says) becomes a checked [`Mechanism`]; [`Dynamics`](dynamics::Dynamics) runs its recursions over any
//! [`Scalar`](dynid_algebra::Scalar). Units are SI, angles rad. Standard parameters are about the joint frame in the axes of the file.

pub mod description;
pub mod dynamics;
pub mod mechanism;
mod motion_block;

pub use description::Description;
pub use mechanism::Mechanism;
pub use motion_block::MotionBlock;
