//! A law of formulas at a joint: the element.

use dynid_algebra::scalar::{Cross, Dual, FusedTask, Jet, Scalar, run_fused};

use super::FormulaAtJoint;
use super::expression::{Formula, Inputs};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::{
    ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, Velocity, temperature_channel,
    temperature_of,
};
use crate::parameter::{Parameter, ShapeParameter};

impl FormulaAtJoint {
    /// Values of all shape parameters: free ones from the shape vector, held ones from their settings.
    fn values(&self, shape: &[f64]) -> Vec<f64> {
        let mut free = shape.iter();
        let value = |s: &crate::element::ShapeSetting| match s.held {
            true => s.start,
            false => free.next().copied().unwrap_or(s.start),
        };
        self.shape.iter().map(value).collect()
    }

    /// Shape parameters that are free.
    fn free(&self) -> impl Iterator<Item = usize> {
        (0..self.shape.len()).filter(|k| !self.shape[*k].held)
    }

    /// Pairs of entry and free parameter whose column changes with it, by the number of the parameter and its place in the shape vector.
    fn pairs(&self) -> impl Iterator<Item = (usize, usize, usize)> {
        let reads = |k: usize, entry: &usize| self.law.formulas[*entry].reads(k);
        self.free().enumerate().flat_map(move |(place, k)| {
            (0..self.law.formulas.len())
                .filter(move |entry| reads(k, entry))
                .map(move |entry| (entry, k, place))
        })
    }

    /// Calls `to` with every sample and the value of a formula there, on numbers that `number` makes of the velocity.
    fn samples<S: Scalar>(
        &self,
        formula: usize,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[S],
        number: impl Fn(f64) -> S,
        to: impl FnMut(usize, S),
    ) {
        let joint = &joints[self.rate].name;
        let logged = self.law.is_thermal().then(|| match temperature_of(motion.channels, joint) {
            Some(logged) => logged,
            None => panic!("motion block without channel `{}`", temperature_channel(joint)),
        });
        let formula = &self.law.formulas[formula];
        let speeds = motion.rate(self.rate);
        run_fused(Samples { formula, speeds, logged, sign_width: motion.sign_width, shape, number, to });
    }
}

/// Samples that are worked on at once.
const BLOCK: usize = 32;

struct Samples<'a, S, F, T> {
    formula: &'a Formula,
    speeds: &'a [f64],
    logged: Option<&'a [f64]>,
    sign_width: f64,
    shape: &'a [S],
    number: F,
    to: T,
}

impl<S: Scalar, F: Fn(f64) -> S, T: FnMut(usize, S)> Samples<'_, S, F, T> {
    #[inline(always)]
    fn run(mut self) {
        let mut stack = Formula::stack::<S, BLOCK>();
        let zero = [S::zero(); BLOCK];
        let mut inputs = Inputs { v: zero, sign: zero, temperature: zero };
        for first in (0..self.speeds.len()).step_by(BLOCK) {
            let count = BLOCK.min(self.speeds.len() - first);
            for k in 0..count {
                let value = (self.number)(self.speeds[first + k]);
                let v = Velocity { value, sign_width: self.sign_width, temperature: S::zero() };
                (inputs.v[k], inputs.sign[k]) = (value, v.sign());
                if let Some(logged) = self.logged {
                    inputs.temperature[k] = S::from_f64(logged[first + k]);
                }
            }
            self.formula.run(&inputs, self.shape, &mut stack, S::power);
            for (k, value) in stack[0].iter().enumerate().take(count) {
                (self.to)(first + k, *value);
            }
        }
    }
}

impl<S: Scalar, F: Fn(f64) -> S, T: FnMut(usize, S)> FusedTask for Samples<'_, S, F, T> {
    #[inline(always)]
    fn fused(self) {
        self.run();
    }
    #[inline(always)]
    fn plain(self) {
        self.run();
    }
}

fn dual(value: f64, derivative: f64) -> Dual<1> {
    Dual { value, derivative: [derivative] }
}

impl JointElement for FormulaAtJoint {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let joint = &joints[self.rate];
        let terms = self.law.terms.columns.iter().map(|(term, _)| term);
        terms.map(|term| joint.parameter(term.symbol, term.units, term.lower)).collect()
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let terms = &self.law.terms.shape;
        self.free().map(|k| terms[k].parameter(&self.shape[k], &joints[self.rate])).collect()
    }
    fn is_friction(&self) -> bool {
        self.law.terms.is_friction
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        let thermal = self.law.is_thermal();
        thermal.then(|| temperature_channel(&joints[self.rate].name)).into_iter().collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..self.law.formulas.len()).map(|k| (self.rate, k)).collect()
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let shape = self.values(shape);
        for entry in 0..self.law.formulas.len() {
            let to = out.column(entry);
            self.samples(entry, joints, motion, &shape, |v| v, |s, value| to[s] = value);
        }
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let temperature = match self.law.is_thermal() {
            true => motion.channel(&temperature_channel(&joints[self.rate].name)),
            false => Some(Jet::zero()),
        };
        let Some(temperature) = temperature else { return false };
        let v = Velocity { value: motion.dq[self.rate], sign_width: motion.sign_width, temperature };
        let shape: Vec<Jet> = self.values(shape).into_iter().map(Jet::from_f64).collect();
        for (to, formula) in out.iter_mut().zip(&self.law.formulas) {
            *to = formula.at(v, &shape);
        }
        true
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        self.pairs().map(|(entry, _, place)| (entry, place)).collect()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let values = self.values(shape);
        for (pair, (entry, k, _)) in self.pairs().enumerate() {
            let by: Vec<Dual<1>> =
                values.iter().enumerate().map(|(p, x)| dual(*x, f64::from(u8::from(p == k)))).collect();
            let to = out.column(pair);
            self.samples(entry, joints, motion, &by, |v| dual(v, 0.0), |s, x| to[s] = x.derivative[0]);
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
        let values = self.values(shape);
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        for (pair, (entry, k, _)) in self.pairs().enumerate() {
            let of =
                |(p, x): (usize, &f64)| Cross { value: *x, a: 0.0, b: f64::from(u8::from(p == k)), ab: 0.0 };
            let by: Vec<Cross> = values.iter().enumerate().map(of).collect();
            let weights = weights.column(pair);
            let number = |v| Cross { value: v, a: 1.0, b: 0.0, ab: 0.0 };
            self.samples(entry, joints, motion, &by, number, |s, x| to[s] += weights[s] * x.ab);
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
        let shape: Vec<Dual<1>> = self.values(shape).into_iter().map(|x| dual(x, 0.0)).collect();
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        for entry in 0..self.law.formulas.len() {
            let weights = weights.column(entry);
            let add = |s: usize, x: Dual<1>| to[s] += weights[s] * x.derivative[0];
            self.samples(entry, joints, motion, &shape, |v| dual(v, 1.0), add);
        }
    }
}
