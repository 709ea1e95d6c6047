//! Why a motion cannot be made.

use dynid_excitation::TaskSpaceError;
use dynid_identify::{Error, Fault};
use dynid_model::closed::PoseError;
use dynid_motion::trajectory::{Quantity, TrajectoryError};

/// A fault of a part of a motion. `part`: its number and what it is.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotionFault {
    /// A part breaks a limit of a joint.
    #[error("{part}: {quantity} of joint `{joint}`: expected {low:.6} to {high:.6}, found {found:.6}")]
    Limit {
        /// The part.
        part: String,
        /// Joint.
        joint: String,
        /// What is beyond its limit.
        quantity: Quantity,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
        /// The value that is farthest beyond.
        found: f64,
        /// Slower motion was tried as well.
        slowed: bool,
    },
    /// A motion that cannot be formed.
    #[error("{part}: {source}")]
    Trajectory {
        /// The part.
        part: String,
        /// The fault.
        source: TrajectoryError,
    },
    /// A circle that cannot be followed.
    #[error("{part}: {source}")]
    Circle {
        /// The part.
        part: String,
        /// The fault.
        source: Box<TaskSpaceError>,
    },
    /// A pose that a mechanism with loops cannot take.
    #[error("{part}, at {time_s:.3} s: {fault}")]
    Pose {
        /// The part, or the way to it.
        part: String,
        /// Time of the motion, s.
        time_s: f64,
        /// The fault.
        fault: Box<PoseError>,
    },
    /// A joint inside of a mechanism with loops leaves its range.
    #[error(
        "{part}, at {time_s:.3} s: position of joint `{joint}`: expected {low:.6} to {high:.6}, found {found:.6}"
    )]
    Inside {
        /// The part, or the way to it.
        part: String,
        /// Time of the motion, s.
        time_s: f64,
        /// Joint.
        joint: String,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
        /// Position.
        found: f64,
    },
}

impl Fault for MotionFault {
    fn hint(&self) -> Option<String> {
        let hint = match self {
            MotionFault::Limit { quantity: Quantity::Position, .. } => {
                "state another range, other points or a smaller motion, or `position` under [limits] where the robot file is too \
                 strict"
            }
            MotionFault::Limit { slowed: true, .. } => {
                "slower motion does not help: state other points or blends"
            }
            MotionFault::Limit { .. } => {
                "lower speeds, longer times or blends keep the limit; `slower = true` (`--slower`) runs the part slower as a whole"
            }
            MotionFault::Trajectory { source: TrajectoryError::ShortSweep { .. }, .. } => {
                "widen `range`, lower the speed, or state a smaller `least_s` and tell `dynid friction` by `least_duration_s`"
            }
            MotionFault::Trajectory { .. } => "correct the numbers of the part",
            MotionFault::Circle { source, .. } => match &**source {
                TaskSpaceError::Mobility { expected, found } if found > expected => {
                    "more joints than the circle needs: `hold_orientation = true` keeps the orientation of the link, \
                     `hold = [\"joint\", ..]` keeps joints where they are"
                }
                TaskSpaceError::Mobility { .. } => {
                    "the joints are too few: `hold_orientation = false` leaves the orientation of the link free; hold fewer joints, or \
                     turn `normal` into the plane of the mechanism"
                }
                TaskSpaceError::SingularStart { .. } | TaskSpaceError::Start(_) => {
                    "state another pose under [start], with bent joints"
                }
                TaskSpaceError::Unreachable { .. } => {
                    "state a smaller radius, another centre, or another pose under [start]"
                }
                _ => "correct the keys of the circle",
            },
            MotionFault::Pose { .. } => "keep the drives nearer to home",
            MotionFault::Inside { .. } => {
                "the drives are within their limits, a joint inside is not: make the motion smaller"
            }
        };
        Some(hint.to_owned())
    }
}

impl From<MotionFault> for Error {
    fn from(fault: MotionFault) -> Self {
        Error::Job(Box::new(fault))
    }
}
