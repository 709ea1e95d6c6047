//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod closed;
mod constraints;
mod designs;
mod envelopes;
mod forecasts;
mod gradients;
mod infeasible;
mod parametrisation;
mod plain_urdf;
mod point_circle;
mod problems;
mod published;
mod refusals;
mod servo;
mod statistics;
mod support;
mod task_space;
