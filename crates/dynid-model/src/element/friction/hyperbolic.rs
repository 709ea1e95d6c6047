//! Coulomb friction with a smooth passage through rest.

use super::{EFFORT, SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::jets::hyperbolic;
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};
use crate::scalar::Jet;
use crate::scalar::elementary::{Curve, map_curve, tanh};

/// Friction `F_t tanh(v/w)`: one column for `ft`, one shape parameter `w` (rad/s, m/s).
///
/// `∂/∂v = sech²(v/w)/w`, `∂/∂w = -v sech²(v/w)/w²`. Passive for `F_t >= 0`. With `w` far below the speeds in use it equals
/// Coulomb friction, with `w` above them viscous friction.
#[derive(Debug, Clone, PartialEq)]
pub struct TanhFriction {
    /// Rate it acts on.
    pub rate: usize,
    /// Width `w`, positive. Default: between 0.001 and 0.3 of the scale of speed, from their geometric mean.
    pub w: ShapeSetting,
}

impl TanhFriction {
    /// For speeds up to about 1 rad/s or m/s.
    pub fn new(rate: usize) -> Self {
        Self::scaled(rate, 1.0)
    }

    /// For speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn scaled(rate: usize, v_max: f64) -> Self {
        TanhFriction { rate, w: ShapeSetting::between(1e-3 * v_max, 0.3 * v_max) }
    }

    fn law(&self, shape: &[f64]) -> Law {
        let [w] = values([&self.w], shape);
        Law { w }
    }
}

struct Law {
    w: f64,
}

impl Law {
    /// `sech²(v/w)`.
    #[inline(always)]
    fn squared_secant(&self, v: f64) -> f64 {
        let t = self.at(v);
        (1.0 - t) * (1.0 + t)
    }
}

impl Curve for Law {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        tanh(v / self.w)
    }
}

/// `tanh(v/w)` for all speeds: friction that saturates, the column of [`TanhFriction`].
pub fn saturating_friction(speeds: &[f64], w: f64) -> Vec<f64> {
    let mut out = speeds.to_vec();
    map_curve(&Law { w }, &mut out);
    out
}

/// Derivative by the width.
struct ByWidth(Law);

impl Curve for ByWidth {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        -v / (self.0.w * self.0.w) * self.0.squared_secant(v)
    }
}

impl JointElement for TanhFriction {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("ft", EFFORT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        shape::free([(&self.w, self.w.parameter(&joints[self.rate], "w", SPEED, true))])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        out.curve(0, motion.rate(self.rate), &self.law(shape));
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places([&self.w]).into_iter().flatten().map(|p| (0, p)).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if !self.w.held {
            out.curve(0, motion.rate(self.rate), &ByWidth(self.law(shape)));
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
        if !self.w.held {
            let law = self.law(shape);
            let bend = |v: f64| {
                let x = v / law.w;
                (2.0 * x * law.at(v) - 1.0) * law.squared_secant(v) / (law.w * law.w)
            };
            weights.add(0, self.rate, motion.rate(self.rate), bend, &mut out.dq);
        }
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let [w] = values([&self.w], shape);
        out[0] = hyperbolic(motion.dq[self.rate], w);
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
        let law = self.law(shape);
        weights.add(0, self.rate, motion.rate(self.rate), |v| law.squared_secant(v) / law.w, &mut out.dq);
    }
}
