//! Tests of the crate.

mod golden;
mod simulated;
mod studies;
