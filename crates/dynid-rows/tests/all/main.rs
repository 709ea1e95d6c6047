//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod arm;
mod calibration;
mod conditioned_rows;
mod friction_choice;
mod live_rows;
mod log_terms;
mod periodic;
mod shaped_rows;
mod steady_rows;
