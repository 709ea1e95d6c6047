//! Friction that is linear in its parameters, and the constant offset.

use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

/// Coulomb friction `F_c s(v)`: `fc`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Coulomb;

impl VelocityLaw<0, 1> for Coulomb {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("fc").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 0] {
        []
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, _: [S; 0]) -> [S; 1] {
        [v.sign()]
    }
}

/// Viscous friction `F_v v`: `fv`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Viscous;

impl VelocityLaw<0, 1> for Viscous {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::viscous("fv").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 0] {
        []
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, _: [S; 0]) -> [S; 1] {
        [v.value()]
    }
}

/// Part of viscous friction that keeps its sign in both directions, `F_va |v|`: `fva`. Beside [`Viscous`] the coefficients are
/// `F_v + F_va` forwards and `F_v - F_va` backwards; both together are passive for `|F_va| <= F_v`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ViscousMagnitude;

impl VelocityLaw<0, 1> for ViscousMagnitude {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::viscous("fva")]
    }
    fn shape(&self) -> [ShapeTerm; 0] {
        []
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, _: [S; 0]) -> [S; 1] {
        [v.speed()]
    }
}

/// Constant effort `F_o`: `fo`, the zero of a current or torque sensor. It is no friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Offset;

impl VelocityLaw<0, 1> for Offset {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("fo")]
    }
    fn shape(&self) -> [ShapeTerm; 0] {
        []
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, _: Velocity<S>, _: [S; 0]) -> [S; 1] {
        [S::one()]
    }
    fn is_friction(&self) -> bool {
        false
    }
}

/// Friction with coefficients of its own for each direction: `F_c⁺ + F_v⁺ v` for `v > 0`, `-F_c⁻ + F_v⁻ v` for `v < 0`, 0 at
/// rest: `fcp`, `fcn`, `fvp`, `fvn`. Beside [`Offset`] its Coulomb columns are collinear: use one or the other.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Asymmetric;

impl VelocityLaw<0, 4> for Asymmetric {
    fn linear(&self) -> [LinearTerm; 4] {
        [
            LinearTerm::effort("fcp").friction(),
            LinearTerm::effort("fcn").friction(),
            LinearTerm::viscous("fvp").friction(),
            LinearTerm::viscous("fvn").friction(),
        ]
    }
    fn shape(&self) -> [ShapeTerm; 0] {
        []
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, _: [S; 0]) -> [S; 4] {
        // Shares of the two directions: (|x| ± x) / 2 is exact.
        let half = S::from_f64(0.5);
        let forward = |x: S| half * (x.magnitude() + x);
        let backward = |x: S| half * (x - x.magnitude());
        let (s, v) = (v.sign(), v.value());
        [forward(s), backward(s), forward(v), backward(v)]
    }
}
