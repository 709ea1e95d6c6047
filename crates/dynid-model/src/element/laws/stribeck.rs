//! Friction of the Stribeck range.

use crate::element::law::units::NUMBER;
use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

/// `E = exp(-|v/v_s|^δ)`: 1 at rest, 0 far above `v_s`.
#[inline(always)]
pub(in crate::element) fn falling<S: Scalar>(v: S, vs: S, delta: S) -> S {
    (v * vs.recip()).magnitude().power(delta).decay()
}

/// Friction that falls from static `F_s` to Coulomb `F_c` with speed, `s(v) (F_c + (F_s - F_c) E)` with
/// `E = exp(-|v/v_s|^δ)`: `fc`, `fs`; shape `vs` (rad/s, m/s), 0.001 .. 0.3 of the largest speed, and `delta`, 0.5 .. 2, held
/// at 2.
///
/// It takes the place of [`Coulomb`](super::Coulomb) (the columns `s (1 - E)` and `s E` add up to `s`); viscous friction stands
/// beside it. Without samples below some `3 v_s`, `fs` and `vs` cannot be estimated. `F_s < F_c` is passive but no Stribeck
/// effect: [`friction_passivity`](crate::RobotModel::friction_passivity) tells. For `δ < 1` the slope of `E` at rest is infinite;
/// the derivative there counts as 0.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stribeck;

impl VelocityLaw<2, 2> for Stribeck {
    const EXPONENT: Option<usize> = Some(1);

    fn linear(&self) -> [LinearTerm; 2] {
        [LinearTerm::effort("fc").friction(), LinearTerm::effort("fs").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 2] {
        [ShapeTerm::speed("vs", 1e-3, 0.3), ShapeTerm::positive("delta", NUMBER, 0.5, 2.0).held_at(2.0)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [vs, delta]: [S; 2]) -> [S; 2] {
        let sign = v.sign();
        let fixed = sign * falling(v.value(), vs, delta);
        [sign - fixed, fixed]
    }
}

/// Viscous friction of the Stribeck range, `F_vs v E` with `E = exp(-|v/v_s|^δ)`: `fvs`; shape `vs`, `delta` as of [`Stribeck`],
/// `delta` held at 1.
///
/// Source: Sun, Shi, Zhang, Wang & Liu, *Parameters Identification Applied to Large Space Robotic Manipulators*, Eqs. 14, 15
/// (the term `C2 θ̇ exp(-|θ̇/ω_s|^δ_s)` of a harmonic drive's input), beside [`Tanh`](super::Tanh) (`C1`),
/// [`Viscous`](super::Viscous) and [`Coulomb`](super::Coulomb). Passive for `F_vs >= 0`. Far below `v_s` it equals viscous
/// friction, far above it vanishes. Its shape parameters have the names of [`Stribeck`]'s: one of both at a joint.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StribeckViscous;

impl VelocityLaw<2, 1> for StribeckViscous {
    const EXPONENT: Option<usize> = Some(1);

    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::viscous("fvs").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 2] {
        [ShapeTerm::speed("vs", 1e-3, 0.3), ShapeTerm::positive("delta", NUMBER, 0.5, 2.0).held_at(1.0)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [vs, delta]: [S; 2]) -> [S; 1] {
        [falling(v.value(), vs, delta) * v.value()]
    }
}
