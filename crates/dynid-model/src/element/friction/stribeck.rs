//! Stribeck friction.

use super::{EFFORT, NUMBER, SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{places, values};
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};

/// Friction that falls from static `F_s` to Coulomb `F_c` with speed, `s(v) (F_c + (F_s - F_c) E)` with
/// `E = exp(-|v/v_s|^δ)`: two columns `[s (1 - E), s E]` for `fc`, `fs`, shape parameters `vs` and `delta`.
///
/// It takes the place of [`Coulomb`](super::Coulomb) (the columns of both are collinear: they add up to `s`); viscous
/// friction stands beside it. `∂E/∂v = -E δ x^δ / v`, `∂E/∂v_s = E δ x^δ / v_s`, `∂E/∂δ = -E x^δ ln x` with
/// `x = |v/v_s|`. Without samples below some `3 v_s`, `fs` and `vs` cannot be estimated. `F_s < F_c` is
/// passive but no Stribeck effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Stribeck {
    /// Rate it acts on.
    pub rate: usize,
    /// Stribeck speed `v_s`, positive. Default: between 0.001 and 0.3 of the scale of speed, from their geometric mean.
    pub vs: ShapeSetting,
    /// Exponent `δ`, positive. Default: held at 2 (bounds 0.5 .. 2).
    pub delta: ShapeSetting,
}

impl Stribeck {
    /// For speeds up to about 1 rad/s or m/s.
    pub fn new(rate: usize) -> Self {
        Self::scaled(rate, 1.0)
    }

    /// For speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn scaled(rate: usize, v_max: f64) -> Self {
        Stribeck {
            rate,
            vs: ShapeSetting::between(1e-3 * v_max, 0.3 * v_max),
            delta: ShapeSetting { start: 2.0, lower: 0.5, upper: 2.0, held: true },
        }
    }

    fn settings(&self) -> [&ShapeSetting; 2] {
        [&self.vs, &self.delta]
    }
}

/// `x^δ`, without a power where there is a cheaper way.
fn power(x: f64, delta: f64) -> f64 {
    if delta == 2.0 {
        x * x
    } else if delta == 1.0 {
        x
    } else {
        x.powf(delta)
    }
}

impl JointElement for Stribeck {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        vec![joint.parameter("fc", EFFORT, Some(0.0)), joint.parameter("fs", EFFORT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let joint = &joints[self.rate];
        let mut out = Vec::new();
        if !self.vs.held {
            out.push(self.vs.parameter(joint, "vs", SPEED, true));
        }
        if !self.delta.held {
            out.push(self.delta.parameter(joint, "delta", NUMBER, true));
        }
        out
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let [vs, delta] = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        let [coulomb, fixed] = out.two_columns(0, 1);
        for ((c, f), v) in coulomb.iter_mut().zip(fixed).zip(speeds) {
            let (s, e) = (motion.sign(*v), (-power((v / vs).abs(), delta)).exp());
            *f = s * e;
            *c = s - *f;
        }
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places(self.settings()).into_iter().flatten().flat_map(|p| [(0, p), (1, p)]).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let [vs, delta] = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        let [by_vs, by_delta] = places(self.settings());
        let mut fill = |place: usize, derivative: &dyn Fn(f64) -> f64| {
            let [coulomb, fixed] = out.two_columns(2 * place, 2 * place + 1);
            for ((c, f), v) in coulomb.iter_mut().zip(fixed).zip(speeds) {
                let x = (v / vs).abs();
                let raised = power(x, delta);
                *f = motion.sign(*v) * (-raised).exp() * raised * derivative(x);
                *c = -*f;
            }
        };
        if let Some(place) = by_vs {
            fill(place, &|_| delta / vs);
        }
        if let Some(place) = by_delta {
            // x^δ ln x goes to 0 with x.
            fill(place, &|x| if x > 0.0 { -x.ln() } else { 0.0 });
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
        let [vs, delta] = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        // s E and its derivative by v; the part of E counts nothing at rest, where s = 0.
        let fixed = |v: f64| {
            let raised = power((v / vs).abs(), delta);
            let e = (-raised).exp();
            let falling = if v == 0.0 { 0.0 } else { motion.sign(v) * e * delta * raised / v };
            motion.sign_slope(v) * e - falling
        };
        weights.add(0, self.rate, speeds, |v| motion.sign_slope(v) - fixed(v), &mut out.dq);
        weights.add(1, self.rate, speeds, fixed, &mut out.dq);
    }
}
