//! A law at a joint: the element that follows from it.

use super::{Velocity, VelocityLaw};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{places, values};
use crate::element::{
    ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, ShapeSetting, temperature_channel,
    temperature_of,
};
use crate::parameter::{Parameter, ShapeParameter};
use dynid_algebra::scalar::{Cross, Dual, FusedTask, Jet, Scalar, run_fused};

/// A [`VelocityLaw`] at a rate, with start, bounds or value of each of its shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct AtJoint<L, const SHAPES: usize, const COLUMNS: usize> {
    /// Rate it acts on.
    pub rate: usize,
    /// The law.
    pub law: L,
    /// Settings of its shape parameters, in the law's order.
    pub shape: [ShapeSetting; SHAPES],
}

impl<L: VelocityLaw<N, M>, const N: usize, const M: usize> AtJoint<L, N, M> {
    /// The law with its own start and bounds, for speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn new(rate: usize, law: L, v_max: f64) -> Self {
        let shape = law.shape().map(|term| term.setting(v_max));
        AtJoint { rate, law, shape }
    }

    fn settings(&self) -> [&ShapeSetting; N] {
        self.shape.each_ref()
    }

    /// The channel of its temperature, if it reads one.
    fn temperature_channel(&self, joints: &[JointInfo]) -> Option<String> {
        let reads = L::THERMAL && self.law.constant_temperature().is_none();
        reads.then(|| temperature_channel(&joints[self.rate].name))
    }

    /// Runs the pass of derivatives by a shape parameter.
    fn run_by_shape(
        &self,
        parameter: usize,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: [f64; N],
        out: impl Sink<M>,
    ) {
        match parameter {
            0 => self.run(ByShape(Known::<0>), joints, motion, shape, out),
            1 => self.run(ByShape(Known::<1>), joints, motion, shape, out),
            _ => self.run(ByShape(parameter), joints, motion, shape, out),
        }
    }

    /// Runs a pass over all samples of a block.
    fn run<P: Pass>(
        &self,
        pass: P,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: [f64; N],
        out: impl Sink<M>,
    ) {
        let speeds = motion.rate(self.rate);
        let law = &self.law;
        // Every choice that is the same for all samples is made outside of the loop, which then has no branches.
        macro_rules! run {
            ($temperature:expr, $exponent:literal) => {{
                let (temperature, sign_width) = ($temperature, motion.sign_width);
                if sign_width > 0.0 {
                    let task = LawTask { pass, law, speeds, temperature, sign_width, shape, out };
                    run_fused(Loop::<_, true, $exponent>(task));
                } else {
                    let task = LawTask { pass, law, speeds, temperature, sign_width, shape, out };
                    run_fused(Loop::<_, false, $exponent>(task));
                }
            }};
        }
        if const { L::THERMAL } {
            let Some(constant) = self.law.constant_temperature() else {
                let joint = &joints[self.rate].name;
                let Some(logged) = temperature_of(motion.channels, joint) else {
                    panic!("motion block without channel `{}`", temperature_channel(joint))
                };
                return run!(|k: usize| logged[k], 0);
            };
            return run!(|_: usize| constant, 0);
        }
        if const { L::EXPONENT.is_some() } {
            match L::EXPONENT.map(|k| shape[k]) {
                Some(1.0) => return run!(|_: usize| 0.0, 1),
                Some(2.0) => return run!(|_: usize| 0.0, 2),
                _ => {}
            }
        }
        run!(|_: usize| 0.0, 0);
    }
}

/// What is wanted of a law: on which numbers it runs and what is read off them.
trait Pass: Copy {
    type Number: Scalar;
    fn velocity(self, v: f64) -> Self::Number;
    fn shape(self, parameter: usize, value: f64) -> Self::Number;
    fn value(self, column: Self::Number) -> f64;
    fn read(self, column: Self::Number) -> f64;
}

/// Columns.
#[derive(Clone, Copy)]
struct Values;
/// Derivatives of the columns by a shape parameter.
#[derive(Clone, Copy)]
struct ByShape<W>(W);
/// Derivatives by the velocity.
#[derive(Clone, Copy)]
struct ByVelocity;
/// Derivatives by the velocity of those by a shape parameter.
#[derive(Clone, Copy)]
struct ByBoth(usize);

/// Which of the shape parameters, known to the compiler or not: what does not depend on it costs nothing where it is known.
trait Which: Copy {
    fn number(self) -> usize;
}

#[derive(Clone, Copy)]
struct Known<const K: usize>;

impl<const K: usize> Which for Known<K> {
    #[inline(always)]
    fn number(self) -> usize {
        K
    }
}

impl Which for usize {
    #[inline(always)]
    fn number(self) -> usize {
        self
    }
}

impl Pass for Values {
    type Number = f64;
    #[inline(always)]
    fn velocity(self, v: f64) -> f64 {
        v
    }
    #[inline(always)]
    fn shape(self, _: usize, value: f64) -> f64 {
        value
    }
    #[inline(always)]
    fn value(self, column: f64) -> f64 {
        column
    }
    #[inline(always)]
    fn read(self, column: f64) -> f64 {
        column
    }
}

impl<W: Which> Pass for ByShape<W> {
    type Number = Dual<1>;
    #[inline(always)]
    fn velocity(self, value: f64) -> Dual<1> {
        Dual { value, derivative: [0.0] }
    }
    #[inline(always)]
    fn shape(self, parameter: usize, value: f64) -> Dual<1> {
        Dual { value, derivative: [if parameter == self.0.number() { 1.0 } else { 0.0 }] }
    }
    #[inline(always)]
    fn value(self, column: Dual<1>) -> f64 {
        column.value
    }
    #[inline(always)]
    fn read(self, column: Dual<1>) -> f64 {
        column.derivative[0]
    }
}

impl Pass for ByVelocity {
    type Number = Dual<1>;
    #[inline(always)]
    fn velocity(self, value: f64) -> Dual<1> {
        Dual { value, derivative: [1.0] }
    }
    #[inline(always)]
    fn shape(self, _: usize, value: f64) -> Dual<1> {
        Dual { value, derivative: [0.0] }
    }
    #[inline(always)]
    fn value(self, column: Dual<1>) -> f64 {
        column.value
    }
    #[inline(always)]
    fn read(self, column: Dual<1>) -> f64 {
        column.derivative[0]
    }
}

impl Pass for ByBoth {
    type Number = Cross;
    #[inline(always)]
    fn velocity(self, value: f64) -> Cross {
        Cross { value, a: 1.0, b: 0.0, ab: 0.0 }
    }
    #[inline(always)]
    fn shape(self, parameter: usize, value: f64) -> Cross {
        Cross { value, a: 0.0, b: if parameter == self.0 { 1.0 } else { 0.0 }, ab: 0.0 }
    }
    #[inline(always)]
    fn value(self, column: Cross) -> f64 {
        column.value
    }
    #[inline(always)]
    fn read(self, column: Cross) -> f64 {
        column.ab
    }
}

/// Where the columns of a sample go.
trait Sink<const M: usize> {
    fn put<P: Pass>(&mut self, sample: usize, pass: P, columns: [P::Number; M]);
}

/// Columns to be filled.
struct Fill<'a, const M: usize>([&'a mut [f64]; M]);

impl<const M: usize> Sink<M> for Fill<'_, M> {
    #[inline(always)]
    fn put<P: Pass>(&mut self, sample: usize, pass: P, columns: [P::Number; M]) {
        for (to, column) in self.0.iter_mut().zip(columns) {
            to[sample] = pass.read(column);
        }
    }
}

/// Columns of values and what a pass reads off them, both to be filled.
struct FillBoth<'a, const M: usize> {
    values: [&'a mut [f64]; M],
    read: [&'a mut [f64]; M],
}

impl<const M: usize> Sink<M> for FillBoth<'_, M> {
    #[inline(always)]
    fn put<P: Pass>(&mut self, sample: usize, pass: P, columns: [P::Number; M]) {
        for (k, column) in columns.into_iter().enumerate() {
            self.values[k][sample] = pass.value(column);
            self.read[k][sample] = pass.read(column);
        }
    }
}

/// Columns to be weighted and added up, one after the other.
struct Add<'a, const M: usize> {
    weights: [&'a [f64]; M],
    to: &'a mut [f64],
}

impl<const M: usize> Sink<M> for Add<'_, M> {
    #[inline(always)]
    fn put<P: Pass>(&mut self, sample: usize, pass: P, columns: [P::Number; M]) {
        let mut sum = self.to[sample];
        for (weight, column) in self.weights.iter().zip(columns) {
            sum += weight[sample] * pass.read(column);
        }
        self.to[sample] = sum;
    }
}

struct LawTask<'a, P, L, T, O, const N: usize, const M: usize> {
    pass: P,
    law: &'a L,
    speeds: &'a [f64],
    temperature: T,
    sign_width: f64,
    shape: [f64; N],
    out: O,
}

/// The loop over samples, for signs that are smooth or not, and for an exponent of 1 or 2 or (0) any.
struct Loop<T, const SMOOTH: bool, const EXPONENT: usize>(T);

impl<P, L, T, O, const N: usize, const M: usize, const SMOOTH: bool, const EXPONENT: usize>
    Loop<LawTask<'_, P, L, T, O, N, M>, SMOOTH, EXPONENT>
where
    P: Pass,
    L: VelocityLaw<N, M>,
    T: Fn(usize) -> f64,
    O: Sink<M>,
{
    #[inline(always)]
    fn run(self) {
        let LawTask { pass, law, speeds, temperature, sign_width, mut shape, mut out } = self.0;
        if let (Some(k), true) = (L::EXPONENT, EXPONENT > 0) {
            shape[k] = EXPONENT as f64;
        }
        let shape = std::array::from_fn(|k| pass.shape(k, shape[k]));
        let sign_width = if SMOOTH { sign_width } else { 0.0 };
        for (sample, v) in speeds.iter().enumerate() {
            let temperature = P::Number::from_f64(temperature(sample));
            let velocity = Velocity { value: pass.velocity(*v), sign_width, temperature };
            let columns = law.columns(velocity, shape);
            out.put(sample, pass, columns);
        }
    }
}

impl<P, L, T, O, const N: usize, const M: usize, const SMOOTH: bool, const EXPONENT: usize> FusedTask
    for Loop<LawTask<'_, P, L, T, O, N, M>, SMOOTH, EXPONENT>
where
    P: Pass,
    L: VelocityLaw<N, M>,
    T: Fn(usize) -> f64,
    O: Sink<M>,
{
    #[inline(always)]
    fn fused(self) {
        self.run();
    }
    #[inline(always)]
    fn plain(self) {
        self.run();
    }
}

impl<L: VelocityLaw<N, M>, const N: usize, const M: usize> JointElement for AtJoint<L, N, M> {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        self.law.linear().iter().map(|term| term.parameter(&joints[self.rate])).collect()
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let terms = self.law.shape();
        let free = terms.iter().zip(&self.shape).filter(|(_, setting)| !setting.held);
        free.map(|(term, setting)| term.parameter(setting, &joints[self.rate])).collect()
    }
    fn is_friction(&self) -> bool {
        self.law.is_friction()
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        self.temperature_channel(joints).into_iter().collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        (0..M).map(|k| (self.rate, k)).collect()
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let shape = values(self.settings(), shape);
        self.run(Values, joints, motion, shape, Fill(out.columns(0)));
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        let free = places(self.settings()).into_iter().flatten();
        free.flat_map(|place| (0..M).map(move |entry| (entry, place))).collect()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let values = values(self.settings(), shape);
        for (parameter, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            self.run_by_shape(parameter, joints, motion, values, Fill(out.columns(M * place)));
        }
    }
    fn fill_with_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        columns: &mut ElementColumns<'_>,
        derivatives: &mut ElementColumns<'_>,
    ) {
        // What a derivative is formed from holds the values too. Most laws have one shape parameter that is free.
        let free: Vec<usize> = (0..N).filter(|k| places(self.settings())[*k].is_some()).collect();
        let [parameter] = free[..] else {
            self.fill(joints, motion, shape, columns);
            self.shape_derivatives(joints, motion, shape, derivatives);
            return;
        };
        let out = FillBoth { values: columns.columns(0), read: derivatives.columns(0) };
        self.run_by_shape(parameter, joints, motion, values(self.settings(), shape), out);
    }
    fn shape_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let values = values(self.settings(), shape);
        for (parameter, place) in places(self.settings()).into_iter().enumerate() {
            let Some(place) = place else { continue };
            let weights = std::array::from_fn(|entry| weights.column(M * place + entry));
            let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
            self.run(ByBoth(parameter), joints, motion, values, Add { weights, to });
        }
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let temperature = match self.temperature_channel(joints) {
            Some(channel) => motion.channel(&channel),
            None => Some(Jet::from_f64(self.law.constant_temperature().unwrap_or(0.0))),
        };
        let Some(temperature) = temperature else { return false };
        let value = motion.dq[self.rate];
        let velocity = Velocity { value, sign_width: motion.sign_width, temperature };
        let shape = values(self.settings(), shape).map(Jet::from_f64);
        out[..M].copy_from_slice(&self.law.columns(velocity, shape));
        true
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let shape = values(self.settings(), shape);
        let weights = std::array::from_fn(|entry| weights.column(entry));
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        self.run(ByVelocity, joints, motion, shape, Add { weights, to });
    }
}
