//! Stribeck friction.

use super::{EFFORT, NUMBER, SPEED};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};
use crate::scalar::Jet;
use crate::scalar::elementary::{Curve, decay, map_curve, map_decay};

/// Friction that falls from static `F_s` to Coulomb `F_c` with speed, `s(v) (F_c + (F_s - F_c) E)` with
/// `E = exp(-|v/v_s|^δ)`: two columns `[s (1 - E), s E]` for `fc`, `fs`, shape parameters `vs` and `delta`.
///
/// It takes the place of [`Coulomb`](super::Coulomb) (the columns of both are collinear: they add up to `s`); viscous
/// friction stands beside it. `∂E/∂v = -E δ x^δ / v`, `∂E/∂v_s = E δ x^δ / v_s`, `∂E/∂δ = -E x^δ ln x` with
/// `x = |v/v_s|`. Without samples below some `3 v_s`, `fs` and `vs` cannot be estimated. `F_s < F_c` is passive but no
/// Stribeck effect: [`friction_passivity`](crate::RobotModel::friction_passivity) tells.
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

    /// `E` at one speed.
    pub(super) fn falling(&self, v: f64, shape: &[f64]) -> f64 {
        let [vs, delta] = values(self.settings(), shape);
        decay(raised((v / vs).abs(), delta))
    }

    fn settings(&self) -> [&ShapeSetting; 2] {
        [&self.vs, &self.delta]
    }
}

/// `x^δ`, without a power where there is a cheaper way.
pub(super) fn raised(x: f64, delta: f64) -> f64 {
    if delta == 2.0 {
        x * x
    } else if delta == 1.0 {
        x
    } else {
        x.powf(delta)
    }
}

/// `v` to `exp(-(v/v_s)²)`.
struct Gauss {
    per_vs: f64,
}

impl Curve for Gauss {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        let x = v * self.per_vs;
        decay(x * x)
    }
}

/// `v` to `s(v) exp(-(v/v_s)²)`.
struct SignedGauss(Gauss);

impl Curve for SignedGauss {
    #[inline(always)]
    fn at(&self, v: f64) -> f64 {
        let e = self.0.at(v);
        let sign = f64::from(u8::from(v > 0.0)) - f64::from(u8::from(v < 0.0));
        sign * e
    }
}

/// `s(v) exp(-(v/v_s)²)` for all speeds: friction that falls from rest, the column `fs` of [`Stribeck`] with `δ = 2`.
pub fn falling_friction(speeds: &[f64], vs: f64) -> Vec<f64> {
    let mut out = speeds.to_vec();
    map_curve(&SignedGauss(Gauss { per_vs: 1.0 / vs }), &mut out);
    out
}

/// Fills `E`.
pub(super) fn fill_falling(speeds: &[f64], [vs, delta]: [f64; 2], out: &mut [f64]) {
    if delta == 2.0 {
        out.copy_from_slice(speeds);
        map_curve(&Gauss { per_vs: 1.0 / vs }, out);
        return;
    }
    for (to, v) in out.iter_mut().zip(speeds) {
        *to = raised((v / vs).abs(), delta);
    }
    map_decay(out);
}

/// `E` with its time derivatives; at rest with `δ < 2`, where it has a kink, the mean of both sides.
pub(super) fn falling_jet(v: Jet, [vs, delta]: [f64; 2]) -> Jet {
    let power = raised((v.value / vs).abs(), delta);
    let e = decay(power);
    let (slope, bend) = if v.value != 0.0 {
        let slope = -e * delta * power / v.value;
        (slope, -slope * (delta * power - delta + 1.0) / v.value)
    } else {
        (0.0, if delta == 2.0 { -2.0 / (vs * vs) } else { 0.0 })
    };
    v.through([e, slope, bend])
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
        shape::free([
            (&self.vs, self.vs.parameter(joint, "vs", SPEED, true)),
            (&self.delta, self.delta.parameter(joint, "delta", NUMBER, true)),
        ])
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0), (self.rate, 1)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let speeds = motion.rate(self.rate);
        let [coulomb, fixed] = out.two_columns(0, 1);
        motion.fill_signs(speeds, coulomb);
        fill_falling(speeds, values(self.settings(), shape), fixed);
        for (c, f) in coulomb.iter_mut().zip(fixed) {
            *f *= *c;
            *c -= *f;
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
        let mut fill = |place: usize, factor: &dyn Fn(f64) -> f64| {
            let [coulomb, fixed] = out.two_columns(2 * place, 2 * place + 1);
            motion.fill_signs(speeds, coulomb);
            fill_falling(speeds, [vs, delta], fixed);
            for ((c, f), v) in coulomb.iter_mut().zip(fixed).zip(speeds) {
                let x = (v / vs).abs();
                *f *= *c * raised(x, delta) * factor(x);
                *c = -*f;
            }
        };
        let [by_vs, by_delta] = places(self.settings());
        if let Some(place) = by_vs {
            fill(place, &|_| delta / vs);
        }
        if let Some(place) = by_delta {
            // x^δ ln x goes to 0 with x.
            fill(place, &|x| if x > 0.0 { -x.ln() } else { 0.0 });
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
        let [vs, delta] = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        // Derivatives by v of s E x^δ and of -s E x^δ ln x.
        let bend = |v: f64, logarithm: bool| {
            let x = (v / vs).abs();
            if x == 0.0 {
                return 0.0;
            }
            let power = raised(x, delta);
            let e = decay(power);
            let (factor, slope) = if logarithm { (-x.ln(), -1.0 / v) } else { (1.0, 0.0) };
            let falling = e * power * (delta * (1.0 - power) / v * factor + slope);
            motion.sign_slope(v) * e * power * factor + motion.sign(v) * falling
        };
        let [by_vs, by_delta] = places(self.settings());
        for (place, scale, logarithm) in [(by_vs, delta / vs, false), (by_delta, 1.0, true)] {
            let Some(place) = place else { continue };
            weights.add(2 * place, self.rate, speeds, |v| -scale * bend(v, logarithm), &mut out.dq);
            weights.add(2 * place + 1, self.rate, speeds, |v| scale * bend(v, logarithm), &mut out.dq);
        }
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let v = motion.dq[self.rate];
        let (sign, falling) = (motion.sign(v), falling_jet(v, values(self.settings(), shape)));
        out[1] = sign * falling;
        out[0] = sign - out[1];
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
        let [vs, delta] = values(self.settings(), shape);
        let speeds = motion.rate(self.rate);
        let fixed = |v: f64| {
            let raised = raised((v / vs).abs(), delta);
            let e = decay(raised);
            // At rest the sign is 0 and the slope of E counts nothing.
            let falling = if v == 0.0 { 0.0 } else { motion.sign(v) * e * delta * raised / v };
            motion.sign_slope(v) * e - falling
        };
        weights.add(0, self.rate, speeds, |v| motion.sign_slope(v) - fixed(v), &mut out.dq);
        weights.add(1, self.rate, speeds, fixed, &mut out.dq);
    }
}
