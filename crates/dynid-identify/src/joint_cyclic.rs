//! A cyclic effort that a joint took.

use dynid_friction::cyclic::CyclicFinding;

/// A cyclic effort that the residuals of a fit showed at a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointCyclic {
    /// Place among the outputs of the model.
    pub output: usize,
    /// The effort.
    pub found: CyclicFinding,
}
