//! URDF: reading, editing in place, writing.

mod edit;
mod inertial;
mod read;
mod write;
mod xml;

pub use edit::{JointDynamics, edit};
pub use read::{parse, read};
pub use write::from_description;
