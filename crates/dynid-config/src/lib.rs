//! What all jobs share: the configuration of a run, logs from files, friction files, limits and nominal values of robots, checkpoints, and
//! the parts that all pages have.

pub mod config;
pub mod fault;
pub mod friction_model;
mod inputs;
pub mod joint_limits;
pub mod logs;
pub mod nominal;
pub mod pages;
pub mod provenance;
pub mod sealed;

pub use config::Config;
pub use friction_model::FrictionModel;
