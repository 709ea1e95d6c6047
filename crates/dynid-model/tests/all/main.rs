//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod adjoint;
mod clearance;
mod closed;
mod elastic;
mod formula;
mod forward_dynamics;
mod friction;
mod golden;
mod history;
mod identities;
mod laws;
mod linearised;
mod passivity;
mod payload;
mod points;
mod random_tree;
mod structure;
mod ties;

#[path = "../robots/mod.rs"]
mod robots;
