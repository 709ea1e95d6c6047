//! Coulomb friction with a smooth passage through rest.

use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

/// Friction `F_t tanh(v/w)`: `ft`; shape `w` (rad/s, m/s), 0.001 .. 0.3 of the largest speed.
///
/// Passive for `F_t >= 0`. With `w` far below the speeds in use it equals Coulomb friction, with `w` above them viscous
/// friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tanh;

impl VelocityLaw<1, 1> for Tanh {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("ft").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::speed("w", 1e-3, 0.3)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [w]: [S; 1]) -> [S; 1] {
        [(v.value() / w).hyperbolic_tangent()]
    }
}
