//! All tests of the crate from outside, in one program: each program would be linked against everything again.

mod broken_files;
mod clearance;
mod closed_robots;
mod loops;
mod meshes;
mod mjcf;
mod mjcf_edit;
mod mjcf_read;
mod mjcf_refused;
mod oracles;
mod robot_files;
mod sdf;
mod xacro;
