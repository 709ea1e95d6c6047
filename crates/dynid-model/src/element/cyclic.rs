//! Efforts that repeat with the position of a joint: torque ripple, cogging, friction that changes over a turn.

use super::friction::EFFORT;
use super::shape::{places, values};
use super::{
    ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, LinearTerm, ShapeSetting, ShapeTerm,
    units,
};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::{Parameter, ShapeParameter};
use dynid_algebra::scalar::{Jet, Scalar, sin_cos_columns};

/// An effort that repeats `n` times a turn, two columns `w cos(n q)`, `w sin(n q)` for the coefficients `A` and `B`.
///
/// `w` is 1 ([`Cyclic::torque`]: ripple and cogging of motors, eccentric gears), or the sign of the velocity ([`Cyclic::friction`]:
/// friction that changes over a turn, of gears that mesh and of bearings that run out). `n` is a tooth count, a number of pole pairs or a gear
/// ratio, and need not be whole. A joint that slides repeats `n` times per `2π` metres.
#[derive(Debug, Clone, PartialEq)]
pub struct Cyclic {
    /// Rate it acts on.
    pub rate: usize,
    /// Repetitions per turn `n`.
    pub cycles: ShapeSetting,
    /// The columns have the sign of the velocity.
    pub is_friction: bool,
}

impl Cyclic {
    /// Coefficients of [`Cyclic::torque`].
    pub const TORQUE: [LinearTerm; 2] = [LinearTerm::effort("ca"), LinearTerm::effort("cb")];
    /// Coefficients of [`Cyclic::friction`].
    pub const FRICTION: [LinearTerm; 2] = [LinearTerm::effort("fca"), LinearTerm::effort("fcb")];
    /// Repetitions per turn of [`Cyclic::torque`], known unless a setting frees them.
    pub const TORQUE_CYCLES: ShapeTerm = Self::term("cycles");
    /// Repetitions per turn of [`Cyclic::friction`], known unless a setting frees them.
    pub const FRICTION_CYCLES: ShapeTerm = Self::term("friction_cycles");

    const fn term(symbol: &'static str) -> ShapeTerm {
        ShapeTerm::positive(symbol, units::REPETITIONS, 0.01, 1e6).held_at(1.0)
    }

    /// `A cos(n q) + B sin(n q)`.
    pub fn torque(rate: usize, cycles: ShapeSetting) -> Self {
        Cyclic { rate, cycles, is_friction: false }
    }

    /// `s(v) (A cos(n q) + B sin(n q))`.
    pub fn friction(rate: usize, cycles: ShapeSetting) -> Self {
        Cyclic { rate, cycles, is_friction: true }
    }

    fn cycles(&self, shape: &[f64]) -> f64 {
        let [cycles] = values([&self.cycles], shape);
        cycles
    }

    /// Both columns at a position and the factor `w`, and their derivatives by the position.
    fn at(q: f64, n: f64, w: f64) -> [[f64; 2]; 2] {
        let (sine, cosine) = (n * q).sin_cos();
        let (sine, cosine) = (w * sine, w * cosine);
        [[cosine, sine], [-n * sine, n * cosine]]
    }

    /// Writes the derivatives of the columns by `n`, `-q w sin(n q)` and `q w cos(n q)`.
    fn by_cycles(q: &[f64], [cosines, sines]: [&[f64]; 2], [first, second]: [&mut [f64]; 2]) {
        for (s, q) in q.iter().enumerate() {
            (first[s], second[s]) = (-q * sines[s], q * cosines[s]);
        }
    }

    fn positions<'a>(&self, joints: &[JointInfo], motion: &MotionBlock<'a>) -> &'a [f64] {
        motion.position(joints[self.rate].position)
    }

    /// Position and velocity of every sample.
    fn signals<'a>(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'a>,
    ) -> impl Iterator<Item = (f64, f64)> + use<'a> {
        let (q, v) = (self.positions(joints, motion), motion.rate(self.rate));
        q.iter().copied().zip(v.iter().copied())
    }

    fn factor(&self, motion: &MotionBlock<'_>, v: f64) -> f64 {
        if self.is_friction { motion.sign(v) } else { 1.0 }
    }
}

impl JointElement for Cyclic {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let terms = if self.is_friction { Self::FRICTION } else { Self::TORQUE };
        terms.map(|term| joints[self.rate].parameter(term.symbol, EFFORT, None)).to_vec()
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let term = if self.is_friction { Self::FRICTION_CYCLES } else { Self::TORQUE_CYCLES };
        let free = (!self.cycles.held).then(|| term.parameter(&self.cycles, &joints[self.rate]));
        free.into_iter().collect()
    }
    fn opposes_motion(&self) -> bool {
        self.is_friction
    }
    fn is_of_position(&self) -> bool {
        !self.is_friction
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let [cosines, sines] = out.columns(0);
        sin_cos_columns(self.cycles(shape), self.positions(joints, motion), sines, cosines);
        if self.is_friction {
            for (v, (cosine, sine)) in motion.rate(self.rate).iter().zip(cosines.iter_mut().zip(sines)) {
                let w = motion.sign(*v);
                *cosine *= w;
                *sine *= w;
            }
        }
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let (sine, cosine) = motion.q[joints[self.rate].position].scaled(self.cycles(shape)).sin_cos();
        let w = if self.is_friction { motion.sign(motion.dq[self.rate]) } else { Jet::one() };
        [out[0], out[1]] = [w * cosine, w * sine];
        true
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        let [place] = places([&self.cycles]);
        place.map_or_else(Vec::new, |place| vec![(0, place), (1, place)])
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if self.cycles.held {
            return;
        }
        self.fill(joints, motion, shape, out);
        let [first, second] = out.columns(0);
        let (cosines, sines) = (first.to_vec(), second.to_vec());
        Self::by_cycles(self.positions(joints, motion), [&cosines, &sines], [first, second]);
    }
    fn fill_with_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        values: &mut ElementColumns<'_>,
        derivatives: &mut ElementColumns<'_>,
    ) {
        self.fill(joints, motion, shape, values);
        if self.cycles.held {
            return;
        }
        let columns = values.columns(0).map(|column| &*column);
        Self::by_cycles(self.positions(joints, motion), columns, derivatives.columns(0));
    }
    fn shape_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if self.cycles.held {
            return;
        }
        let (n, position, samples) = (self.cycles(shape), joints[self.rate].position, motion.samples);
        for (s, (q, v)) in self.signals(joints, motion).enumerate() {
            let (a, b) = (weights.column(0)[s], weights.column(1)[s]);
            let (sine, cosine) = (n * q).sin_cos();
            let by_position = -a * (sine + n * q * cosine) + b * (cosine - n * q * sine);
            out.q[position * samples + s] += self.factor(motion, v) * by_position;
            if self.is_friction {
                let of_sign = q * (b * cosine - a * sine);
                out.dq[self.rate * samples + s] += motion.sign_slope(v) * of_sign;
            }
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
        let (n, position, samples) = (self.cycles(shape), joints[self.rate].position, motion.samples);
        for (s, (q, v)) in self.signals(joints, motion).enumerate() {
            let (a, b) = (weights.column(0)[s], weights.column(1)[s]);
            let [_, [first, second]] = Self::at(q, n, self.factor(motion, v));
            out.q[position * samples + s] += a * first + b * second;
            if self.is_friction {
                let [[cosine, sine], ..] = Self::at(q, n, motion.sign_slope(v));
                out.dq[self.rate * samples + s] += a * cosine + b * sine;
            }
        }
    }
}
