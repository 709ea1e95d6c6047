//! Tests of the crate.

mod golden;
mod models;
mod simulated;
mod studies;
