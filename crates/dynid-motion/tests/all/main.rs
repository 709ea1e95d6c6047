//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod emps;
mod golden;
mod noise;
mod periodic_signals;
mod recorded;
mod scipy;
mod test_motions;
mod trajectories;
mod trajectory_golden;
