//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod book;
mod broken_input;
mod clearance;
mod command_line;
mod contract;
mod design;
mod diff;
mod elastic;
mod estimator_settings;
mod explain;
mod export;
mod faults;
mod flags;
mod fleet;
mod friction;
mod logs_of_tools;
#[cfg(target_os = "linux")]
mod memory;
mod motion;
mod online;
mod other_libraries;
mod papers;
mod payload;
mod provenance;
mod round_trip;
mod schemas;
mod study;
mod support;
mod xacro;
