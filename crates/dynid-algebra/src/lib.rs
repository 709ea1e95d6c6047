//! Numbers that carry derivatives, numbers in lanes, and the algebra of rigid bodies over them.
//!
//! What is written once over [`Scalar`] runs as `f64`, as SIMD lanes, as dual numbers and as jets (time derivatives).
//! [`Vec3`] and [`Mat3`] are vectors and matrices of such numbers, [`Placement`] a frame in another; [`symmetric`] decomposes small
//! symmetric matrices, [`Inertia`] holds the ten parameters of a body.
//!
//! Units are SI, angles rad.

pub mod inertia;
pub mod scalar;
pub mod spatial;
pub mod symmetric;

pub use inertia::Inertia;
pub use scalar::Scalar;
pub use spatial::{Mat3, Placement, Vec3};
