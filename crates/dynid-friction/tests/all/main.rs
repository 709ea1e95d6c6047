//! All tests of the crate from outside, in one program: each program would be linked against everything again.

#[path = "../../../dynid-estimate/tests/all/golden/mod.rs"]
#[expect(dead_code, reason = "shared with other crates, whose tests compare in more ways")]
mod golden;
mod prr3;
mod prr3_fits;
mod prr3_machine;
mod sign_rounds;
mod steady_friction;
