//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod accuracy;
mod contract;
mod rank_sum;
