//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod golden;
mod noise;
mod periodic_signals;
mod recorded;
mod scipy;
mod test_motions;
mod textbook;
mod trajectories;
mod trajectory_golden;
