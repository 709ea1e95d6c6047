//! Friction that follows the forces which press on a joint.

use super::placed::Stribeck;
use super::{NUMBER, PER_SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::laws::falling;
use crate::element::shape::values;
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::parameter::{Parameter, ShapeParameter};

const REACTION: &str = "reaction_";
const WEIGHT: &str = "weight_";

/// Name of the channel that holds the reaction which presses on a joint, N (or N m, where it acts on a radius); not negative.
pub fn reaction_channel(joint: &str) -> String {
    format!("{REACTION}{joint}")
}

/// Name of the channel that holds the steady part of the force which presses on a joint, N or N m; not negative.
pub fn weight_channel(joint: &str) -> String {
    format!("{WEIGHT}{joint}")
}

/// Friction of a joint that follows the reaction `F` which presses on it and a steady force `F_w` (a weight):
///
/// ```text
/// e = [μ_c + (μ_s - μ_c) E] F s(v) + μ_c F_w s(v) + μ_v (F + F_w) v,   E = exp(-|v/v_s|^δ)
/// ```
///
/// Columns `F s (1 - E) + F_w s` and `F s E` for `mu_c`, `mu_s` (numbers without unit); without the Stribeck effect (`E = 0`)
/// one column `(F + F_w) s` for `mu_c`. A last column `(F + F_w) v` for `mu_v` (s/rad or s/m) where friction grows with speed.
/// `F`, `F_w` come from channels ([`reaction_channel`], [`weight_channel`]), which a
/// [`ClosedModel`](crate::ClosedModel) computes itself. Source: Rosyid & El-Khasawneh 2020, equations 23 and 39;
/// the steady force has no Stribeck effect there.
#[derive(Debug, Clone, PartialEq)]
pub struct ReactionFriction {
    /// Rate, and shape parameters `vs` (m/s or rad/s) and `delta`.
    pub law: Stribeck,
    /// Whether friction falls with speed; without, shape parameters are not used.
    pub falls: bool,
    /// Whether friction grows with speed (`mu_v`).
    pub viscous: bool,
}

/// Friction that follows a reaction, as an element shows it.
#[derive(Debug, Clone, Copy)]
pub struct FollowingFriction<'a> {
    /// The law.
    pub law: &'a ReactionFriction,
    /// Values of its shape parameters where the element holds them; `None`: they are parameters of the model.
    pub held: Option<&'a [f64]>,
}

impl ReactionFriction {
    /// Number of coefficients.
    fn coefficients(&self) -> usize {
        1 + usize::from(self.falls) + usize::from(self.viscous)
    }

    fn forces<'a>(&self, joints: &[JointInfo], motion: &MotionBlock<'a>) -> [&'a [f64]; 2] {
        let joint = &joints[self.law.rate].name;
        [reaction_channel(joint), weight_channel(joint)].map(|name| {
            let Some(force) = motion.channel(&name) else { panic!("motion block without channel `{name}`") };
            force
        })
    }

    /// `E` at one speed.
    fn falling(&self, v: f64, shape: &[f64]) -> f64 {
        let [vs, delta] = values([&self.law.vs, &self.law.delta], shape);
        falling(v, vs, delta)
    }

    /// Friction per unit of `F` and of `F_w` at one speed, for coefficients in the order of the parameters.
    pub(crate) fn per_force(&self, motion: &MotionBlock<'_>, v: f64, shape: &[f64], mu: &[f64]) -> [f64; 2] {
        let sign = motion.sign(v);
        let falling = if self.falls { self.falling(v, shape) } else { 0.0 };
        let fixed = if self.falls { mu[1] } else { mu[0] };
        let growing = if self.viscous { mu[self.coefficients() - 1] * v } else { 0.0 };
        [sign * (mu[0] + (fixed - mu[0]) * falling) + growing, sign * mu[0] + growing]
    }
}

impl JointElement for ReactionFriction {
    fn rates(&self) -> Vec<usize> {
        vec![self.law.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let coefficient = |symbol, unit| joints[self.law.rate].parameter(symbol, unit, Some(0.0));
        let mut out = vec![coefficient("mu_c", NUMBER)];
        out.extend(self.falls.then(|| coefficient("mu_s", NUMBER)));
        out.extend(self.viscous.then(|| coefficient("mu_v", PER_SPEED)));
        out
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        if self.falls { self.law.shape(joints) } else { Vec::new() }
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..self.coefficients()).map(|k| (self.law.rate, k)).collect()
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        let joint = &joints[self.law.rate].name;
        vec![reaction_channel(joint), weight_channel(joint)]
    }
    fn reaction_friction(&self) -> Option<FollowingFriction<'_>> {
        Some(FollowingFriction { law: self, held: None })
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let [force, weight] = self.forces(joints, motion);
        let speeds = motion.rate(self.law.rate);
        if self.falls {
            self.law.fill(joints, motion, shape, out);
            for k in 0..2 {
                out.column(k).iter_mut().zip(force).for_each(|(c, f)| *c *= f);
            }
        } else {
            motion.fill_signs(speeds, out.column(0));
            out.column(0).iter_mut().zip(force).for_each(|(c, f)| *c *= f);
        }
        for ((c, w), v) in out.column(0).iter_mut().zip(weight).zip(speeds) {
            *c += w * motion.sign(*v);
        }
        if self.viscous {
            let forces = force.iter().zip(weight);
            let column = out.column(self.coefficients() - 1);
            column.iter_mut().zip(forces).zip(speeds).for_each(|((c, (f, w)), v)| *c = (f + w) * v);
        }
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        if self.falls { self.law.shape_entries() } else { Vec::new() }
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if !self.falls {
            return;
        }
        let [force, _] = self.forces(joints, motion);
        self.law.shape_derivatives(joints, motion, shape, out);
        for k in 0..self.law.shape_entries().len() {
            out.column(k).iter_mut().zip(force).for_each(|(c, f)| *c *= f);
        }
    }
    fn shape_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if self.falls {
            let pairs = self.law.shape_entries().len();
            let (data, slots) = self.times_force(joints, motion, weights, pairs);
            let samples = motion.samples;
            let weights = ElementWeights { data: &data, slots: &slots, stride: samples, samples };
            self.law.shape_adjoint(joints, motion, shape, &weights, out);
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let [force, weight] = self.forces(joints, motion);
        let (samples, rate) = (motion.samples, self.law.rate);
        let speeds = motion.rate(rate);
        let own = weights.column(0);
        for (s, v) in speeds.iter().enumerate() {
            let pressed = weight[s] + if self.falls { 0.0 } else { force[s] };
            out.dq[rate * samples + s] += own[s] * pressed * motion.sign_slope(*v);
        }
        if self.viscous {
            let own = weights.column(self.coefficients() - 1);
            let to = out.dq[rate * samples..][..samples].iter_mut();
            to.zip(own).zip(force.iter().zip(weight)).for_each(|((to, x), (f, w))| *to += x * (f + w));
        }
        if self.falls {
            let (data, slots) = self.times_force(joints, motion, weights, 2);
            let weights = ElementWeights { data: &data, slots: &slots, stride: samples, samples };
            self.law.adjoint(joints, motion, shape, &weights, out);
        }
    }
}

impl ReactionFriction {
    /// Weights of the columns of the law for weights of these columns, and where they are.
    fn times_force(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        weights: &ElementWeights<'_>,
        columns: usize,
    ) -> (Vec<f64>, Vec<usize>) {
        let [force, _] = self.forces(joints, motion);
        let scaled = |k: usize| weights.column(k).iter().zip(force).map(|(w, f)| w * f);
        ((0..columns).flat_map(scaled).collect(), (0..columns).collect())
    }
}
