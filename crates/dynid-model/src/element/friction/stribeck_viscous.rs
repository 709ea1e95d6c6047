//! Viscous friction that fades with speed.

use super::stribeck::{falling_jet, fill_falling, raised};
use super::{NUMBER, SPEED, VISCOUS};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{self, places, values};
use crate::element::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo, ShapeSetting};
use crate::parameter::{Parameter, ShapeParameter};
use crate::scalar::Jet;
use crate::scalar::elementary::decay;

/// Viscous friction of the Stribeck range, `F_vs v E` with `E = exp(-|v/v_s|^δ)`: one column for `fvs`, shape parameters `vs`
/// and `delta`.
///
/// Source: Sun, Shi, Zhang, Wang & Liu, *Parameters Identification Applied to Large Space Robotic Manipulators*, Eqs. 14, 15
/// (the term `C2 θ̇ exp(-|θ̇/ω_s|^δ_s)` of a harmonic drive's input), beside
/// [`TanhFriction`](super::TanhFriction) (`C1`), [`Viscous`](super::Viscous) and [`Coulomb`](super::Coulomb).
///
/// With `x = |v/v_s|`: `∂/∂v = E (1 - δ x^δ)`, `∂/∂v_s = v E δ x^δ / v_s`, `∂/∂δ = -v E x^δ ln x`. Passive for `F_vs >= 0`.
/// Far below `v_s` it equals viscous friction, far above it vanishes. Its shape parameters have the names of
/// [`Stribeck`](super::Stribeck)'s: one of both at a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct StribeckViscous {
    /// Rate it acts on.
    pub rate: usize,
    /// Stribeck speed `v_s`, positive. Default: between 0.001 and 0.3 of the scale of speed, from their geometric mean.
    pub vs: ShapeSetting,
    /// Exponent `δ`, positive. Default: held at 1 (bounds 0.5 .. 2).
    pub delta: ShapeSetting,
}

impl StribeckViscous {
    /// For speeds up to about 1 rad/s or m/s.
    pub fn new(rate: usize) -> Self {
        Self::scaled(rate, 1.0)
    }

    /// For speeds up to `v_max`, rad/s or m/s, above 0.
    pub fn scaled(rate: usize, v_max: f64) -> Self {
        StribeckViscous {
            rate,
            vs: ShapeSetting::between(1e-3 * v_max, 0.3 * v_max),
            delta: ShapeSetting { start: 1.0, lower: 0.5, upper: 2.0, held: true },
        }
    }

    fn settings(&self) -> [&ShapeSetting; 2] {
        [&self.vs, &self.delta]
    }
}

impl JointElement for StribeckViscous {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fvs", VISCOUS, Some(0.0))]
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
        vec![(self.rate, 0)]
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, shape: &[f64], out: &mut ElementColumns<'_>) {
        let speeds = motion.rate(self.rate);
        fill_falling(speeds, values(self.settings(), shape), out.column(0));
        out.column(0).iter_mut().zip(speeds).for_each(|(e, v)| *e *= v);
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
        let [vs, delta] = values(self.settings(), shape);
        let bent = |v: f64, logarithm: bool| {
            let x = (v / vs).abs();
            // x^δ ln x goes to 0 with x.
            let factor = if !logarithm {
                delta / vs
            } else if x > 0.0 {
                -x.ln()
            } else {
                0.0
            };
            let power = raised(x, delta);
            v * decay(power) * power * factor
        };
        for (place, logarithm) in places(self.settings()).into_iter().zip([false, true]) {
            if let Some(place) = place {
                out.map(place, motion.rate(self.rate), |v| bent(v, logarithm));
            }
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
        // Derivatives by v of v E x^δ and of -v E x^δ ln x.
        let bend = |v: f64, logarithm: bool| {
            let x = (v / vs).abs();
            if x == 0.0 {
                return 0.0;
            }
            let power = raised(x, delta);
            let rising = 1.0 + delta * (1.0 - power);
            decay(power) * power * if logarithm { -(x.ln() * rising + 1.0) } else { rising }
        };
        let [by_vs, by_delta] = places(self.settings());
        for (place, scale, logarithm) in [(by_vs, delta / vs, false), (by_delta, 1.0, true)] {
            let Some(place) = place else { continue };
            let speeds = motion.rate(self.rate);
            weights.add(place, self.rate, speeds, |v| scale * bend(v, logarithm), &mut out.dq);
        }
    }
    fn jets(&self, _: &[JointInfo], motion: &JetMotion<'_>, shape: &[f64], out: &mut [Jet]) -> bool {
        let v = motion.dq[self.rate];
        out[0] = v * falling_jet(v, values(self.settings(), shape));
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
        let slope = |v: f64| {
            let power = raised((v / vs).abs(), delta);
            decay(power) * (1.0 - delta * power)
        };
        weights.add(0, self.rate, motion.rate(self.rate), slope, &mut out.dq);
    }
}
