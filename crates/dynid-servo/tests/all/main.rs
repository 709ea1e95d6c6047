//! Tests of the crate, one program.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod arm;
mod efforts;
mod gears;
mod golden;
mod identification;
mod motion;
mod quadruped;
