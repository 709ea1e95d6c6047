//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod design;
mod report;
mod study;
