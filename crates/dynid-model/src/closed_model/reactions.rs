//! Forces in joints and cuts over blocks, linear in the parameters.

/// A component of a force or couple that the mechanism carries inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Of the wrench that the parent exerts on a body through its joint, about the joint frame's origin, in its axes.
    Joint {
        /// Body.
        body: usize,
        /// 0 to 2: force along x, y, z, N; 3 to 5: moment, N m.
        component: usize,
    },
    /// Multiplier of a condition.
    Multiplier {
        /// Number of the condition.
        condition: usize,
    },
}
