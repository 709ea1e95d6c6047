//! Friction of velocity, and the constant offset (spec/elements.md section 2).

mod arctangent;
mod linear;
mod stribeck;

pub use arctangent::Arctangent;
pub use linear::{AsymmetricFriction, Coulomb, Offset, Viscous};
pub use stribeck::Stribeck;

pub(super) const EFFORT: [&str; 2] = ["N m", "N"];
pub(super) const VISCOUS: [&str; 2] = ["N m s/rad", "N s/m"];
const SPEED: [&str; 2] = ["rad/s", "m/s"];
const PER_SPEED: [&str; 2] = ["s/rad", "s/m"];
const NUMBER: [&str; 2] = ["1", "1"];
