//! Friction that grows as a power of speed.

use crate::element::law::units::NUMBER;
use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

const COEFFICIENT: [&str; 2] = ["N m (s/rad)^p", "N (s/m)^p"];

/// Friction `F_p s(v) |v|^p`: `fp`; shape `p`, 0.2 .. 2.
///
/// Passive for `F_p >= 0`. For `p < 1` the slope at rest is infinite; the derivative there counts as 0: no solver that needs
/// derivatives should pass through rest with it. With `p = 1` it equals viscous friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Power;

impl VelocityLaw<1, 1> for Power {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::new("fp", COEFFICIENT).friction()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::positive("p", NUMBER, 0.2, 2.0)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [p]: [S; 1]) -> [S; 1] {
        [v.sign() * v.speed().power(p)]
    }
}
