//! Tests of the crate, one program.

mod golden;
