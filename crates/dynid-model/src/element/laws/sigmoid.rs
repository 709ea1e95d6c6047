//! Friction that passes through rest as a logistic function.

use crate::element::law::units::{PER_SPEED, SPEED};
use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

/// Friction `F_g [S(φ₂ (v + φ₃)) - S(φ₂ φ₃)]` with `S(x) = 1/(1 + e^-x)`, zero at rest: `fg`; shape `phi2` (s/rad, s/m),
/// 1 .. 1000, and `phi3` (rad/s, m/s), ±0.1.
///
/// Passive for `F_g >= 0`. Bounds do not go with the speeds in use: the steepness of the passage through rest says nothing of
/// the largest speed. `S` holds at any argument; `φ₂` up to 460 s/rad occurs. Source: Gaz, Cognetti, Oliva, Robuffo Giordano &
/// De Luca 2019 (Panda).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Sigmoid;

impl VelocityLaw<2, 1> for Sigmoid {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("fg").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 2] {
        [ShapeTerm::positive("phi2", PER_SPEED, 1.0, 1e3), ShapeTerm::signed("phi3", SPEED, 0.1)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [phi2, phi3]: [S; 2]) -> [S; 1] {
        [(phi2 * (v.value() + phi3)).logistic() - (phi2 * phi3).logistic()]
    }
}

/// Friction `F_l S(α (v + ν))` with `S(x) = 1/(1 + e^-x)`: `fl`; shape `alpha` (s/rad, s/m), 1 .. 1000, and `nu` (rad/s, m/s),
/// ±0.1.
///
/// It runs from 0 to `F_l`: beside it stand [`Offset`](super::Offset), which centres it, and viscous friction, as in models of
/// the UR10. Passive for `F_l >= 0` once its value at rest is counted as offset. Bounds and arguments as of [`Sigmoid`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SigmoidOffset;

impl VelocityLaw<2, 1> for SigmoidOffset {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("fl").friction()]
    }
    fn shape(&self) -> [ShapeTerm; 2] {
        [ShapeTerm::positive("alpha", PER_SPEED, 1.0, 1e3), ShapeTerm::signed("nu", SPEED, 0.1)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [alpha, nu]: [S; 2]) -> [S; 1] {
        [(alpha * (v.value() + nu)).logistic()]
    }
}
