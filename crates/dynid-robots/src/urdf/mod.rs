//! URDF: reading, editing in place, writing.

mod dynamics;
mod edit;
pub(crate) mod inertial;
mod read;
mod shapes;
mod write;
pub(crate) mod xml;

pub use dynamics::dynamics;
pub use edit::{JointDynamics, edit};
pub use read::{parse, read};
pub use shapes::{LinkShape, Shape, ShapeRole, parse_shapes};
pub use write::from_description;
