//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod arm;
mod clearance;
mod closed;
mod elastic;
mod experiment;
mod integration;
mod pointing;
mod presliding;
mod slopes;
