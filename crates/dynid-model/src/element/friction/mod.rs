//! Friction at a joint: laws of velocity, bristles, friction that follows loads.

mod journal;
mod load;
mod lugre;
mod maxwell_slip;
mod placed;
mod reaction;

pub use journal::{JournalFriction, journal_moment_channel};
pub use load::LoadFriction;
pub use lugre::LuGre;
pub use maxwell_slip::{MaxwellSlip, SlipSpring};
pub use placed::{
    Arctangent, AsymmetricFriction, Coulomb, ExponentialViscous, Offset, PowerLaw, Sigmoid, SigmoidOffset,
    Stribeck, StribeckViscous, TanhFriction, Viscous, ViscousMagnitude,
};
pub use reaction::{FollowingFriction, ReactionFriction, reaction_channel, weight_channel};

use super::JointInfo;
pub(super) use super::law::units::{EFFORT, VISCOUS};
use super::law::units::{NUMBER, PER_ANGLE, PER_SPEED, POSITION};
use crate::dynamics::MotionBlock;

/// A signal of a joint that an element remembers, `<joint>.<name>`; `None` where the steady state stands in for it.
fn remembered<'a>(joint: &JointInfo, motion: &MotionBlock<'a>, name: &str) -> Option<&'a [f64]> {
    let is_it = |channel: &str| {
        let rest = channel.strip_prefix(joint.name.as_str()).and_then(|rest| rest.strip_prefix('.'));
        rest == Some(name)
    };
    let (_, values) = motion.channels.iter().find(|(channel, _)| is_it(channel))?;
    Some(&values[..motion.samples])
}
