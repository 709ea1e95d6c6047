//! Laws of velocity that come with the crate, each a [`VelocityLaw`](super::VelocityLaw) written once.
//!
//! `s(v)` is the sign of the velocity with `s(0) = 0`. Bounds of shape parameters are defaults for speeds up to 1 rad/s or
//! m/s; [`AtJoint::new`](super::AtJoint::new) scales them.

mod arctangent;
mod exponential_viscous;
mod linear;
mod power;
mod sigmoid;
mod stribeck;
mod tanh;

pub use arctangent::Arctangent;
pub use exponential_viscous::ExponentialViscous;
pub use linear::{Asymmetric, Coulomb, Offset, Viscous, ViscousMagnitude};
pub use power::Power;
pub use sigmoid::{Sigmoid, SigmoidOffset};
pub(super) use stribeck::falling;
pub use stribeck::{Stribeck, StribeckViscous};
pub use tanh::Tanh;
