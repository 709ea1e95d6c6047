//! Tests of the recursive estimator.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

mod golden;
mod stream;
