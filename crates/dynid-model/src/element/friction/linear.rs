//! Friction that is linear in its parameters, and the constant offset.

use super::{EFFORT, VISCOUS};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, sign};
use crate::parameter::Parameter;
use crate::scalar::{Jet, Scalar};

/// Coulomb friction `F_c s(v)`, one column.
#[derive(Debug, Clone, PartialEq)]
pub struct Coulomb {
    /// Rate it acts on.
    pub rate: usize,
}

/// Viscous friction `F_v v`, one column.
#[derive(Debug, Clone, PartialEq)]
pub struct Viscous {
    /// Rate it acts on.
    pub rate: usize,
}

/// Part of viscous friction that keeps its sign in both directions, `F_va |v|`, one column: beside [`Viscous`], coefficients
/// `F_v + F_va` forwards and `F_v - F_va` backwards. Passive together with it for `|F_va| <= F_v`.
#[derive(Debug, Clone, PartialEq)]
pub struct ViscousMagnitude {
    /// Rate it acts on.
    pub rate: usize,
}

/// Constant effort `F_o`, one column: zero of the current or torque sensor.
#[derive(Debug, Clone, PartialEq)]
pub struct Offset {
    /// Rate it acts on.
    pub rate: usize,
}

/// Friction with a law of its own for each direction: `F_c⁺ + F_v⁺ v` for `v > 0`, `-F_c⁻ + F_v⁻ v` for `v < 0`, 0 at rest.
/// Four columns. Together with [`Offset`] its Coulomb columns are collinear: use one or the other.
#[derive(Debug, Clone, PartialEq)]
pub struct AsymmetricFriction {
    /// Rate it acts on.
    pub rate: usize,
}

impl JointElement for Coulomb {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fc", EFFORT, Some(0.0))]
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.map(0, motion.rate(self.rate), |v| motion.sign(v));
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        out[0] = motion.sign(motion.dq[self.rate]);
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
        weights.add(0, self.rate, motion.rate(self.rate), |v| motion.sign_slope(v), &mut out.dq);
    }
}

impl JointElement for Viscous {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fv", VISCOUS, Some(0.0))]
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.map(0, motion.rate(self.rate), |v| v);
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        out[0] = motion.dq[self.rate];
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
        weights.add(0, self.rate, motion.rate(self.rate), |_| 1.0, &mut out.dq);
    }
}

impl JointElement for ViscousMagnitude {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fva", VISCOUS, None)]
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.map(0, motion.rate(self.rate), f64::abs);
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        let v = motion.dq[self.rate];
        out[0] = v.scaled(sign(v.value));
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
        weights.add(0, self.rate, motion.rate(self.rate), sign, &mut out.dq);
    }
}

impl JointElement for Offset {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fo", EFFORT, None)]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], _: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.column(0).fill(1.0);
    }
    fn jets(&self, _: &[JointInfo], _: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        out[0] = Jet::one();
        true
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        _: &MotionBlock<'_>,
        _: &[f64],
        _: &ElementWeights<'_>,
        _: &mut MotionAdjoint,
    ) {
    }
}

impl JointElement for AsymmetricFriction {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        vec![
            joint.parameter("fcp", EFFORT, Some(0.0)),
            joint.parameter("fcn", EFFORT, Some(0.0)),
            joint.parameter("fvp", VISCOUS, Some(0.0)),
            joint.parameter("fvn", VISCOUS, Some(0.0)),
        ]
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..4).map(|k| (self.rate, k)).collect()
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let v = motion.rate(self.rate);
        // With an exact sign both shares vanish at rest.
        let share = |v: f64| {
            let s = motion.sign(v);
            [0.5 * (s.abs() + s), 0.5 * (s.abs() - s)]
        };
        out.map(0, v, |v| share(v)[0]);
        out.map(1, v, |v| -share(v)[1]);
        out.map(2, v, |v| v.max(0.0));
        out.map(3, v, |v| v.min(0.0));
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let v = motion.rate(self.rate);
        // Share of a velocity among the forward ones: the derivative of max(v, 0).
        let forward = |v: f64| 0.5 * (1.0 + sign(v));
        weights.add(0, self.rate, v, |v| forward(v) * motion.sign_slope(v), &mut out.dq);
        weights.add(1, self.rate, v, |v| forward(-v) * motion.sign_slope(v), &mut out.dq);
        weights.add(2, self.rate, v, forward, &mut out.dq);
        weights.add(3, self.rate, v, |v| forward(-v), &mut out.dq);
    }
}
