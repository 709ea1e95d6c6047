//! Tests of the recursive estimator.
#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "in tests a panic is the report")]

mod excitation;
mod false_alarms;
mod forgetting;
mod golden;
mod harmonic_drive;
mod long_runs;
mod modes;
mod reaction;
mod saved_state;
mod stream;
mod unusable_input;
