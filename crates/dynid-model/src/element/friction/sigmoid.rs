//! Friction that passes through rest as a logistic function.

use super::{EFFORT, PER_SPEED, SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};
use crate::scalar::elementary::{Curve, logistic, logistic_slope};

/// Friction `F_g [S(φ₂ (v + φ₃)) - S(φ₂ φ₃)]` with `S(x) = 1/(1 + e^-x)`, zero at rest: one column for `fg`, shape parameters
/// `phi2` (s/rad, s/m) and `phi3` (rad/s, m/s).
///
/// With `S' = S (1 - S)`: `∂/∂v = φ₂ S'`, `∂/∂φ₂ = (v + φ₃) S' - φ₃ S'(φ₂ φ₃)`, `∂/∂φ₃ = φ₂ [S' - S'(φ₂ φ₃)]`. Passive for
/// `F_g >= 0`. Gaz et al. (2019) use it for the Panda.
#[derive(Debug, Clone, PartialEq)]
pub struct Sigmoid {
    /// Rate it acts on.
    pub rate: usize,
    /// Slope `φ₂`, positive. Default: between 1 and 1000, from their geometric mean.
    pub phi2: ShapeSetting,
    /// Shift `φ₃`. Default: between -0.1 and 0.1, from 0.
    pub phi3: ShapeSetting,
}

/// Friction `F_l S(α (v + ν))` with `S(x) = 1/(1 + e^-x)`: one column for `fl`, shape parameters `alpha` (s/rad, s/m) and `nu`
/// (rad/s, m/s).
///
/// It runs from 0 to `F_l`: beside it stand [`Offset`](super::Offset), which centres it, and viscous friction, as in
/// models of the UR10. `∂/∂v = α S'`, `∂/∂α = (v + ν) S'`, `∂/∂ν = α S'` with `S' = S (1 - S)`. Passive for `F_l >= 0` once
/// its value at rest is counted as offset.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmoidOffset {
    /// Rate it acts on.
    pub rate: usize,
    /// Slope `α`, positive. Default: between 1 and 1000, from their geometric mean.
    pub alpha: ShapeSetting,
    /// Shift `ν`. Default: between -0.1 and 0.1, from 0.
    pub nu: ShapeSetting,
}

fn slope_setting() -> ShapeSetting {
    ShapeSetting::between(1.0, 1e3)
}

fn shift_setting() -> ShapeSetting {
    ShapeSetting { start: 0.0, lower: -0.1, upper: 0.1, held: false }
}

impl Sigmoid {
    /// Default settings. They do not scale with the speeds in use: the
    /// steepness of the passage through rest says nothing of the largest speed.
    pub fn new(rate: usize) -> Self {
        Sigmoid { rate, phi2: slope_setting(), phi3: shift_setting() }
    }

    fn settings(&self) -> [&ShapeSetting; 2] {
        [&self.phi2, &self.phi3]
    }
}

impl SigmoidOffset {
    /// Default settings, as those of [`Sigmoid::new`].
    pub fn new(rate: usize) -> Self {
        SigmoidOffset { rate, alpha: slope_setting(), nu: shift_setting() }
    }

    fn settings(&self) -> [&ShapeSetting; 2] {
        [&self.alpha, &self.nu]
    }
}

/// `S(slope (v + shift)) - base`.
struct Law {
    slope: f64,
    shift: f64,
    base: f64,
}

impl Curve for Law {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        logistic(self.slope * (v + self.shift)) - self.base
    }
}

/// `(factor + by_speed (v + shift)) S'(slope (v + shift)) - base`.
struct Derivative {
    slope: f64,
    shift: f64,
    factor: f64,
    by_speed: f64,
    base: f64,
}

impl Derivative {
    fn by_slope([slope, shift]: [f64; 2]) -> Self {
        Derivative { slope, shift, factor: 0.0, by_speed: 1.0, base: 0.0 }
    }

    /// By the shift, or by the velocity.
    fn by_shift([slope, shift]: [f64; 2]) -> Self {
        Derivative { slope, shift, factor: slope, by_speed: 0.0, base: 0.0 }
    }

    /// Less its own value at rest.
    fn zero_at_rest(self) -> Self {
        Derivative { base: self.at(0.0), ..self }
    }
}

impl Curve for Derivative {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        let x = v + self.shift;
        (self.factor + self.by_speed * x) * logistic_slope(self.slope * x) - self.base
    }
}

/// Adds the derivatives by the velocity of those by slope and shift, which both forms share: a base does not move.
fn bend(
    places: [Option<usize>; 2],
    [slope, shift]: [f64; 2],
    rate: usize,
    motion: &MotionBlock<'_>,
    weights: &ElementWeights<'_>,
    out: &mut MotionAdjoint,
) {
    // S'' = S' (1 - 2 S)
    let second = |x: f64| logistic_slope(x) * (1.0 - 2.0 * logistic(x));
    let [by_slope, by_shift] = places;
    if let Some(place) = by_slope {
        let of_speed = |v: f64| {
            let x = slope * (v + shift);
            logistic_slope(x) + x * second(x)
        };
        weights.add(place, rate, motion.rate(rate), of_speed, &mut out.dq);
    }
    if let Some(place) = by_shift {
        let of_speed = |v: f64| slope * slope * second(slope * (v + shift));
        weights.add(place, rate, motion.rate(rate), of_speed, &mut out.dq);
    }
}

impl JointElement for Sigmoid {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fg", EFFORT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let joint = &joints[self.rate];
        shape::free([
            (&self.phi2, self.phi2.parameter(joint, "phi2", PER_SPEED, true)),
            (&self.phi3, self.phi3.parameter(joint, "phi3", SPEED, false)),
        ])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let [slope, shift] = values(self.settings(), shape);
        let law = Law { slope, shift, base: 0.0 };
        out.curve(0, motion.rate(self.rate), &Law { base: law.at(0.0), ..law });
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places(self.settings()).into_iter().flatten().map(|p| (0, p)).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let (at, speeds) = (values(self.settings(), shape), motion.rate(self.rate));
        let [by_slope, by_shift] = places(self.settings());
        if let Some(place) = by_slope {
            out.curve(place, speeds, &Derivative::by_slope(at).zero_at_rest());
        }
        if let Some(place) = by_shift {
            out.curve(place, speeds, &Derivative::by_shift(at).zero_at_rest());
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
        let at = values(self.settings(), shape);
        bend(places(self.settings()), at, self.rate, motion, weights, out);
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let slope = Derivative::by_shift(values(self.settings(), shape));
        weights.add(0, self.rate, motion.rate(self.rate), |v| slope.at(v), &mut out.dq);
    }
}

impl JointElement for SigmoidOffset {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fl", EFFORT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let joint = &joints[self.rate];
        shape::free([
            (&self.alpha, self.alpha.parameter(joint, "alpha", PER_SPEED, true)),
            (&self.nu, self.nu.parameter(joint, "nu", SPEED, false)),
        ])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let [slope, shift] = values(self.settings(), shape);
        out.curve(0, motion.rate(self.rate), &Law { slope, shift, base: 0.0 });
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places(self.settings()).into_iter().flatten().map(|p| (0, p)).collect()
    }
    fn shape_derivatives(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let (at, speeds) = (values(self.settings(), shape), motion.rate(self.rate));
        let [by_slope, by_shift] = places(self.settings());
        if let Some(place) = by_slope {
            out.curve(place, speeds, &Derivative::by_slope(at));
        }
        if let Some(place) = by_shift {
            out.curve(place, speeds, &Derivative::by_shift(at));
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
        let at = values(self.settings(), shape);
        bend(places(self.settings()), at, self.rate, motion, weights, out);
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let slope = Derivative::by_shift(values(self.settings(), shape));
        weights.add(0, self.rate, motion.rate(self.rate), |v| slope.at(v), &mut out.dq);
    }
}
