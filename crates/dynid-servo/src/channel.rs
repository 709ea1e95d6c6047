//! What logs measure of a joint.

/// What is measured of a joint, and can be in the sum of squares of a fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Channel {
    /// Encoder readings, rad or m.
    Position,
    /// Velocities of the encoders, rad/s or m/s.
    Velocity,
    /// Efforts, N m or N.
    Effort,
    /// Currents of the drives, A.
    Current,
}

impl Channel {
    /// All channels, in order.
    pub const ALL: [Channel; 4] = [Channel::Position, Channel::Velocity, Channel::Effort, Channel::Current];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Channel::Position => "position",
            Channel::Velocity => "velocity",
            Channel::Effort => "effort",
            Channel::Current => "current",
        }
    }

    /// Whether it tells an effort, be it in amperes.
    pub fn tells_effort(self) -> bool {
        matches!(self, Channel::Effort | Channel::Current)
    }
}

/// Where an effort is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum EffortAt {
    /// At the drive, as a current tells it: rotor and friction take their part behind it.
    #[default]
    Drive,
    /// Between gear and link, where a joint torque sensor sits: what the bodies alone take.
    Link,
}
