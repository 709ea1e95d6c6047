//! What can keep an experiment from running.

use dynid_model::NotPositive;
use dynid_model::closed::{ClosedError, PoseError};

mod forward;

pub use forward::ForwardError;

/// Why an experiment was refused or had to stop.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// A setting is out of range.
    #[error("{name}: expected {expected}, found {found}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// What it must be.
        expected: &'static str,
        /// The value given.
        found: String,
    },
    /// A list has not one entry per joint, parameter or channel.
    #[error("{name}: expected {expected} entries, found {found}")]
    Length {
        /// Name of the list.
        name: &'static str,
        /// Entries needed.
        expected: usize,
        /// Entries given.
        found: usize,
    },
    /// A floating base has a quaternion among its positions and no drive.
    #[error("a floating base cannot be controlled: simulate the arm alone")]
    FloatingBase,
    /// An element reads a channel that nothing feeds.
    #[error("no profile for the channel `{name}`")]
    Channel {
        /// Name of the channel.
        name: String,
    },
    /// The effort per acceleration of an element depends on the state.
    #[error("an element's effort per acceleration depends on the state (joint {rate}, counted from 0)")]
    VaryingInertia {
        /// Rate whose row changes.
        rate: usize,
    },
    /// A coordinate without bodies has no inertia to accelerate: a motor without a rotor.
    #[error("coordinate `{name}` has no inertia: give it a rotor inertia above 0")]
    NoInertia {
        /// Name of the coordinate.
        name: String,
    },
    /// Positions of a controlled robot have no slopes: some joint has neither inertia nor damping nor gain.
    #[error(
        "the slopes of the positions are not determined from row {row} on: a joint has neither inertia nor damping nor gain"
    )]
    NoSlopes {
        /// Row of the motion.
        row: usize,
    },
    /// A spring that softens cannot carry a torque.
    #[error("the transmission of `{joint}` cannot carry {torque} (N m or N): its spring softens before")]
    Overloaded {
        /// Link behind the transmission.
        joint: String,
        /// The torque.
        torque: f64,
    },
    /// An element offers no time derivatives of its effort.
    #[error(
        "the element of `{parameter}` offers no time derivatives: it cannot stand behind an elastic transmission"
    )]
    NoTimeDerivatives {
        /// First parameter of the element.
        parameter: String,
    },
    /// The plant has a joint without inertia.
    #[error("at {time} s {source}")]
    Inertia {
        /// Time, s.
        time: f64,
        /// Which joint.
        source: NotPositive,
    },
    /// A robot with loops, or with friction that follows reactions, where one without is needed.
    #[error(
        "expected a robot without loops and friction that follows reactions, found one with: it is a plant of its own kind"
    )]
    ClosedMechanism,
    /// A robot without loops and without friction that follows reactions where one with either is needed.
    #[error("expected a robot with loops or with friction that follows reactions, found one without")]
    NoLoops,
    /// Loops of a mechanism do not go with its drives.
    #[error(transparent)]
    Loops(#[from] ClosedError),
    /// The reference leads a closed mechanism where it cannot be, or next to a singular pose.
    #[error("at {time:.4} s the reference cannot be followed: {source}")]
    Pose {
        /// Time, s.
        time: f64,
        /// Why.
        source: PoseError,
    },
    /// Drives of an over-actuated mechanism are wanted where they cannot be together.
    #[error(
        "at {time:.4} s the reference of `{drive}` is off by {gap:.2e} (rad or m) from where the other drives put it"
    )]
    Reference {
        /// Time, s.
        time: f64,
        /// Name of the drive.
        drive: String,
        /// Difference of positions.
        gap: f64,
    },
    /// A closed mechanism does not move on from a state.
    #[error("at {time} s {source}")]
    Forward {
        /// Time, s.
        time: f64,
        /// Why.
        source: ForwardError,
    },
    /// The motion changes faster than the integrator may follow: an unstable control loop, or nearly no inertia.
    #[error(
        "at {time} s the motion changes too fast to be followed ({steps} steps within a control interval): is the \
         control loop stable?"
    )]
    TooFast {
        /// Time, s.
        time: f64,
        /// Steps made in the interval.
        steps: usize,
    },
}

/// Fails unless `found` satisfies `ok`.
pub(crate) fn demand(
    ok: bool,
    name: &'static str,
    expected: &'static str,
    found: impl ToString,
) -> Result<(), SimError> {
    if ok { Ok(()) } else { Err(SimError::Setting { name, expected, found: found.to_string() }) }
}

/// Fails unless a list has as many entries as it must.
pub(crate) fn demand_length(name: &'static str, expected: usize, found: usize) -> Result<(), SimError> {
    if expected == found { Ok(()) } else { Err(SimError::Length { name, expected, found }) }
}
