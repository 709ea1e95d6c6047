//! A law of formulas at a joint: the element.

use dynid_algebra::scalar::{Cross, Dual, FusedTask, Jet, Scalar, run_fused};

use super::FormulaAtJoint;
use super::expression::{Formula, Inputs, Instant};
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

    /// By what of position and velocity a formula has derivatives: the steps of both, and where the derivatives go.
    fn derivatives<'a>(
        &self,
        formula: usize,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        out: &'a mut MotionAdjoint,
    ) -> impl Iterator<Item = ([f64; 2], &'a mut [f64])> {
        let formula = &self.law.formulas[formula];
        let samples = motion.samples;
        let of = |to: &'a mut [f64], coordinate: usize| &mut to[coordinate * samples..][..samples];
        let by_position = formula.is_positional().then_some([1.0, 0.0]);
        let by_velocity = formula.is_of_velocity().then_some([0.0, 1.0]);
        let position = by_position.map(|steps| (steps, of(&mut out.q, joints[self.rate].position)));
        let velocity = by_velocity.map(|steps| (steps, of(&mut out.dq, self.rate)));
        position.into_iter().chain(velocity)
    }

    /// Calls `to` with every sample and the value of a formula there, on numbers that `number` makes of position and velocity.
    fn samples<S: Scalar>(
        &self,
        formula: usize,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[S],
        number: impl Fn([f64; 2]) -> [S; 2],
        to: impl FnMut(usize, S),
    ) {
        let joint = &joints[self.rate].name;
        let logged = self.law.is_thermal().then(|| match temperature_of(motion.channels, joint) {
            Some(logged) => logged,
            None => panic!("motion block without channel `{}`", temperature_channel(joint)),
        });
        let formula = &self.law.formulas[formula];
        let speeds = motion.rate(self.rate);
        // Reports on friction over velocities have no positions.
        let places = formula.is_positional().then(|| motion.position(joints[self.rate].position));
        run_fused(Samples {
            formula,
            speeds,
            places,
            logged,
            sign_width: motion.sign_width,
            shape,
            number,
            to,
        });
    }
}

/// Samples that are worked on at once.
const BLOCK: usize = 32;

struct Samples<'a, S, F, T> {
    formula: &'a Formula,
    speeds: &'a [f64],
    places: Option<&'a [f64]>,
    logged: Option<&'a [f64]>,
    sign_width: f64,
    shape: &'a [S],
    number: F,
    to: T,
}

impl<S: Scalar, F: Fn([f64; 2]) -> [S; 2], T: FnMut(usize, S)> Samples<'_, S, F, T> {
    #[inline(always)]
    fn run(mut self) {
        let mut stack = Formula::stack::<S, BLOCK>();
        let zero = [S::zero(); BLOCK];
        let mut inputs = Inputs { q: zero, v: zero, sign: zero, temperature: zero };
        for first in (0..self.speeds.len()).step_by(BLOCK) {
            let count = BLOCK.min(self.speeds.len() - first);
            for k in 0..count {
                let [q, value] =
                    (self.number)([self.places.map_or(0.0, |q| q[first + k]), self.speeds[first + k]]);
                let v = Velocity { value, sign_width: self.sign_width, temperature: S::zero() };
                (inputs.q[k], inputs.v[k], inputs.sign[k]) = (q, value, v.sign());
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

impl<S: Scalar, F: Fn([f64; 2]) -> [S; 2], T: FnMut(usize, S)> FusedTask for Samples<'_, S, F, T> {
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
        self.law.is_friction()
    }
    fn opposes_motion(&self) -> bool {
        self.law.terms.is_friction
    }
    fn is_of_position(&self) -> bool {
        let formulas = &self.law.formulas;
        self.law.is_positional() && !formulas.iter().any(|f| f.is_of_velocity() || f.is_thermal())
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
            self.samples(entry, joints, motion, &shape, |state| state, |s, value| to[s] = value);
        }
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let temperature = match self.law.is_thermal() {
            true => motion.channel(&temperature_channel(&joints[self.rate].name)),
            false => Some(Jet::zero()),
        };
        let Some(temperature) = temperature else { return false };
        let v = Velocity { value: motion.dq[self.rate], sign_width: motion.sign_width, temperature };
        let q = motion.q[joints[self.rate].position];
        let shape: Vec<Jet> = self.values(shape).into_iter().map(Jet::from_f64).collect();
        for (to, formula) in out.iter_mut().zip(&self.law.formulas) {
            *to = formula.at(Instant { q, v }, &shape);
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
            let number = |state: [f64; 2]| state.map(|x| dual(x, 0.0));
            self.samples(entry, joints, motion, &by, number, |s, x| to[s] = x.derivative[0]);
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
        for (pair, (entry, k, _)) in self.pairs().enumerate() {
            let of =
                |(p, x): (usize, &f64)| Cross { value: *x, a: 0.0, b: f64::from(u8::from(p == k)), ab: 0.0 };
            let by: Vec<Cross> = values.iter().enumerate().map(of).collect();
            let weights = weights.column(pair);
            for (steps, to) in self.derivatives(entry, joints, motion, out) {
                let number =
                    |state: [f64; 2]| [0, 1].map(|s| Cross { value: state[s], a: steps[s], b: 0.0, ab: 0.0 });
                self.samples(entry, joints, motion, &by, number, |s, x| to[s] += weights[s] * x.ab);
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
        let shape: Vec<Dual<1>> = self.values(shape).into_iter().map(|x| dual(x, 0.0)).collect();
        for entry in 0..self.law.formulas.len() {
            let weights = weights.column(entry);
            for (steps, to) in self.derivatives(entry, joints, motion, out) {
                let number = |state: [f64; 2]| [0, 1].map(|s| dual(state[s], steps[s]));
                let add = |s: usize, x: Dual<1>| to[s] += weights[s] * x.derivative[0];
                self.samples(entry, joints, motion, &shape, number, add);
            }
        }
    }
}
