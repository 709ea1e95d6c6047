//! A spring between a joint and the body that carries it.

use super::friction::EFFORT;
use super::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;
use dynid_algebra::scalar::{Jet, Scalar as _};

/// Linear spring `k (q - q₀) = k q - (k q₀)`, two columns `[q, -1]` for `k` and `k q₀`.
#[derive(Debug, Clone, PartialEq)]
pub struct Spring {
    /// Rate it acts on.
    pub rate: usize,
}

impl JointElement for Spring {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        vec![joint.parameter("k", ["N m/rad", "N/m"], Some(0.0)), joint.parameter("kq0", EFFORT, None)]
    }
    fn is_of_position(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.map(0, motion.position(joints[self.rate].position), |q| q);
        out.column(1).fill(-1.0);
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        out[0] = motion.q[joints[self.rate].position];
        out[1] = -Jet::one();
        true
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let position = joints[self.rate].position;
        weights.add(0, position, motion.position(position), |_| 1.0, &mut out.q);
    }
}
