//! What the residuals of a joint hold that follows its position.

use dynid_friction::cyclic::{CyclicFinding, SlowFinding};

/// A cyclic effort that the residuals of a fit showed at a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCyclic {
    /// Place among the outputs of the model.
    pub output: usize,
    /// The effort.
    pub found: CyclicFinding,
}

/// What the residual of a fit holds of slow functions of the position of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSlow {
    /// Place among the outputs of the model.
    pub output: usize,
    /// How much.
    pub found: SlowFinding,
}
