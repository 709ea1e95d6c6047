//! Friction of velocity, and the constant offset.

mod arctangent;
mod exponential_viscous;
mod hyperbolic;
mod linear;
mod load;
mod lugre;
mod power_law;
mod reaction;
mod sigmoid;
mod stribeck;
mod stribeck_viscous;

pub use arctangent::Arctangent;
pub use exponential_viscous::ExponentialViscous;
pub use hyperbolic::{TanhFriction, saturating_friction};
pub use linear::{AsymmetricFriction, Coulomb, Offset, Viscous, ViscousMagnitude};
pub use load::LoadFriction;
pub use lugre::LuGre;
pub use power_law::PowerLaw;
pub use reaction::{ReactionFriction, reaction_channel, weight_channel};
pub use sigmoid::{Sigmoid, SigmoidOffset};
pub use stribeck::{Stribeck, falling_friction};
pub use stribeck_viscous::StribeckViscous;

pub(super) const EFFORT: [&str; 2] = ["N m", "N"];
pub(super) const VISCOUS: [&str; 2] = ["N m s/rad", "N s/m"];
const SPEED: [&str; 2] = ["rad/s", "m/s"];
const PER_ANGLE: [&str; 2] = ["1/rad", "1/m"];
const PER_SPEED: [&str; 2] = ["s/rad", "s/m"];
const NUMBER: [&str; 2] = ["1", "1"];
