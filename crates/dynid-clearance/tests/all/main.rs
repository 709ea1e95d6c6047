//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod backlash;
mod clearance;
mod deformation;
#[path = "../../../dynid-estimate/tests/all/golden/mod.rs"]
mod golden;
