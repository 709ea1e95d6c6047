//! Tests of the crate, one program.

mod arm;
mod golden;
mod identification;
mod motion;
