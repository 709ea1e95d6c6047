//! Rotor inertia reflected to the joint.

use super::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;
use dynid_algebra::scalar::Jet;

/// Reflected rotor inertia `I_a q̈` on its own joint, `I_a = n² J` (gyroscopic coupling neglected), one column.
///
/// Degenerate: on a joint whose axis stays fixed in space it merges with the link's moment of inertia about that axis.
#[derive(Debug, Clone, PartialEq)]
pub struct RotorInertia {
    /// Rate it acts on.
    pub rate: usize,
}

impl JointElement for RotorInertia {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("Ia", ["kg m²", "kg"], Some(0.0))]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.map(0, motion.acceleration(self.rate), |a| a);
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        out[0] = motion.ddq[self.rate];
        true
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        weights.add(0, self.rate, motion.acceleration(self.rate), |_| 1.0, &mut out.ddq);
    }
}
