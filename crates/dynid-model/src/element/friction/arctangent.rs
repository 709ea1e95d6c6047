//! Arctangent friction.

use super::{EFFORT, PER_SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};
use crate::scalar::Jet;
use crate::scalar::elementary::{Curve, atan};

/// Friction `F_a atan(f_b v)`: one column `atan(f_b v)` for `fa`, one shape parameter `fb` (s/rad, s/m).
///
/// `∂/∂v = f_b / (1 + f_b² v²)`, `∂/∂f_b = v / (1 + f_b² v²)`. Beside Coulomb and viscous friction it forms the law of
/// the ER-16; `fa` may then be negative (friction that falls from rest). With `f_b v_max < 1` the column
/// equals viscous friction, with `f_b |v| > 100` Coulomb friction.
#[derive(Debug, Clone, PartialEq)]
pub struct Arctangent {
    /// Rate it acts on.
    pub rate: usize,
    /// Slope parameter `f_b`, positive. Default: 10 in 1 .. 100, all divided by the scale of speed.
    pub fb: ShapeSetting,
}

impl Arctangent {
    /// For speeds up to about 1 rad/s or m/s.
    pub fn new(rate: usize) -> Self {
        Self::scaled(rate, 1.0)
    }

    /// For speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn scaled(rate: usize, v_max: f64) -> Self {
        Arctangent { rate, fb: ShapeSetting::between(1.0 / v_max, 100.0 / v_max) }
    }

    fn slope(&self, shape: &[f64]) -> f64 {
        let [fb] = values([&self.fb], shape);
        fb
    }
}

struct Law {
    fb: f64,
}

impl Curve for Law {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        atan(self.fb * v)
    }
}

impl JointElement for Arctangent {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fa", EFFORT, None)]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        shape::free([(&self.fb, self.fb.parameter(&joints[self.rate], "fb", PER_SPEED, true))])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        out.curve(0, motion.rate(self.rate), &Law { fb: self.slope(shape) });
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places([&self.fb]).into_iter().flatten().map(|p| (0, p)).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if !self.fb.held {
            let fb = self.slope(shape);
            out.map(0, motion.rate(self.rate), |v| v / (1.0 + (fb * v) * (fb * v)));
        }
    }
    fn shape_adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if !self.fb.held {
            let fb = self.slope(shape);
            let bend = |v: f64| {
                let square = (fb * v) * (fb * v);
                (1.0 - square) / ((1.0 + square) * (1.0 + square))
            };
            weights.add(0, self.rate, motion.rate(self.rate), bend, &mut out.dq);
        }
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let (fb, v) = (self.slope(shape), motion.dq[self.rate]);
        let x = fb * v.value;
        let slope = fb / (1.0 + x * x);
        out[0] = v.through([x.atan(), slope, -2.0 * x * slope * slope]);
        true
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let fb = self.slope(shape);
        let slope = |v: f64| fb / (1.0 + (fb * v) * (fb * v));
        weights.add(0, self.rate, motion.rate(self.rate), slope, &mut out.dq);
    }
}
