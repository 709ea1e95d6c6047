//! Friction that grows as a power of speed.

use super::NUMBER;
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};

const COEFFICIENT: [&str; 2] = ["N m (s/rad)^p", "N (s/m)^p"];

/// Friction `F_p s(v) |v|^p`: one column for `fp`, one shape parameter `p`.
///
/// `∂/∂v = F_p p |v|^(p-1)` (beside the slope of a smooth sign), `∂/∂p = F_p s |v|^p ln |v|`. Passive for `F_p >= 0`. For
/// `p < 1` the slope at rest is infinite; the derivative there is given as 0, the sign's value: no solver that needs
/// derivatives should pass through rest with it. With `p = 1` it equals viscous friction.
#[derive(Debug, Clone, PartialEq)]
pub struct PowerLaw {
    /// Rate it acts on.
    pub rate: usize,
    /// Exponent `p`, positive. Default: between 0.2 and 2, from their geometric mean.
    pub p: ShapeSetting,
}

impl PowerLaw {
    /// Default settings.
    pub fn new(rate: usize) -> Self {
        PowerLaw { rate, p: ShapeSetting::between(0.2, 2.0) }
    }

    fn exponent(&self, shape: &[f64]) -> f64 {
        let [p] = values([&self.p], shape);
        p
    }
}

impl JointElement for PowerLaw {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fp", COEFFICIENT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        shape::free([(&self.p, self.p.parameter(&joints[self.rate], "p", NUMBER, true))])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let p = self.exponent(shape);
        out.map(0, motion.rate(self.rate), |v| motion.sign(v) * v.abs().powf(p));
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places([&self.p]).into_iter().flatten().map(|p| (0, p)).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if !self.p.held {
            let p = self.exponent(shape);
            let derivative = |v: f64| {
                let a = v.abs();
                if a > 0.0 { motion.sign(v) * a.powf(p) * a.ln() } else { 0.0 }
            };
            out.map(0, motion.rate(self.rate), derivative);
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
        if !self.p.held {
            let p = self.exponent(shape);
            let bend = |v: f64| {
                if v == 0.0 {
                    return 0.0;
                }
                let (power, log) = (v.abs().powf(p), v.abs().ln());
                motion.sign_slope(v) * power * log + motion.sign(v) * power / v * (p * log + 1.0)
            };
            weights.add(0, self.rate, motion.rate(self.rate), bend, &mut out.dq);
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let p = self.exponent(shape);
        let slope = |v: f64| {
            if v == 0.0 {
                return 0.0;
            }
            let power = v.abs().powf(p);
            motion.sign_slope(v) * power + motion.sign(v) * p * power / v
        };
        weights.add(0, self.rate, motion.rate(self.rate), slope, &mut out.dq);
    }
}
