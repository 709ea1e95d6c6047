//! Friction at a joint: laws of velocity, bristles, friction that follows loads.

mod journal;
mod load;
mod lugre;
mod placed;
mod reaction;

pub use journal::{JournalFriction, journal_moment_channel};
pub use load::LoadFriction;
pub use lugre::LuGre;
pub use placed::{
    Arctangent, AsymmetricFriction, Coulomb, ExponentialViscous, Offset, PowerLaw, Sigmoid, SigmoidOffset,
    Stribeck, StribeckViscous, TanhFriction, Viscous, ViscousMagnitude,
};
pub use reaction::{FollowingFriction, ReactionFriction, reaction_channel, weight_channel};

pub(super) use super::law::units::{EFFORT, VISCOUS};
use super::law::units::{NUMBER, PER_ANGLE, PER_SPEED};
