//! Motion of all joints along a motion of the independent coordinates, and its derivatives.

use super::ClosedModel;
use crate::dynamics::{MotionAdjoint, MotionBlock};

/// Motion of all joints of the tree over a block: rate `r`, sample `s` at `[r * samples + s]`.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMotion {
    /// Number of samples.
    pub samples: usize,
    /// Positions, by position entries.
    pub q: Vec<f64>,
    /// Rates.
    pub dq: Vec<f64>,
    /// Accelerations.
    pub ddq: Vec<f64>,
}

impl JointMotion {
    /// The motion as a block, for the tree's own dynamics.
    pub fn block(&self) -> MotionBlock<'_> {
        MotionBlock::plain(self.samples, &self.q, &self.dq, &self.ddq)
    }
}

impl ClosedModel {
    /// Motion of all joints. Samples without a pose are not numbers.
    ///
    /// # Panics
    /// If the motion has other dimensions than the model.
    pub fn joint_motion(&self, motion: &MotionBlock<'_>) -> JointMotion {
        let expanded = self.expand(motion);
        JointMotion { samples: expanded.samples, q: expanded.q, dq: expanded.dq, ddq: expanded.ddq }
    }

    /// Adds to `out` the derivatives of `Σ weights ∘ joint motion` with respect to the motion of the independent
    /// coordinates; `weights` as [`ClosedModel::joint_motion`] orders its entries. Samples without a pose are not numbers.
    ///
    /// # Panics
    /// If dimensions differ, or a joint floats.
    pub fn joint_motion_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        weights: &MotionAdjoint,
        out: &mut MotionAdjoint,
    ) {
        let tree = self.machine.mechanism();
        assert_eq!(tree.positions(), tree.rates(), "derivatives by the orientation of a joint that floats");
        weights.check((tree.positions(), tree.rates()), motion.samples);
        out.check((self.machine.mobility(), self.machine.mobility()), motion.samples);
        let (expanded, poses) = self.expand_keeping(motion);
        self.carry_all(&expanded, &poses, weights, |_| Vec::new(), out);
    }
}
