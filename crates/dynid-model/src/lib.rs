//! Mechanisms, joint elements, inverse dynamics, regressors and base parameters.

pub mod description;
pub mod inertia;
pub mod scalar;
pub mod spatial;

pub use description::{Description, JointDescription, JointKind, Limits, LinkDescription, Mimic};
pub use inertia::Inertia;
pub use scalar::Scalar;
pub use spatial::{Mat3, Placement, Vec3};
