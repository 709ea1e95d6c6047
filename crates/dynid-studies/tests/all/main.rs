//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod claims;
mod command_line;
mod support;
