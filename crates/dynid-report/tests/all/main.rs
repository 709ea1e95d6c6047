//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod design;
mod first_screen;
mod report;
mod study;
