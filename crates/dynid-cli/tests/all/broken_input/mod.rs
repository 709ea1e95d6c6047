//! Broken input gets exit code 2, one message that says where and what, at most one hint, and leaves nothing behind.

mod bounds;
mod configurations;
mod csv;
mod designs;
mod estimates_and_states;
mod estimators;
mod friction;
mod harness;
mod log_files;
mod log_signals;
mod outputs_and_usage;
mod robots_in_toml;
mod robots_in_urdf;
mod trajectories;
mod validation_logs;
mod virtual_experiments;
