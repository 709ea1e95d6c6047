//! Arctangent friction.

use crate::element::{LinearTerm, ShapeTerm, Velocity, VelocityLaw};
use dynid_algebra::scalar::Scalar;

/// Friction `F_a atan(f_b v)`: `fa`; shape `fb` (s/rad, s/m), 1 .. 100 over the largest speed.
///
/// Beside Coulomb and viscous friction it forms the law of the ER-16; `fa` may then be negative (friction that falls from
/// rest). With `f_b v_max < 1` the column equals viscous friction, with `f_b |v| > 100` Coulomb friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Arctangent;

impl VelocityLaw<1, 1> for Arctangent {
    fn linear(&self) -> [LinearTerm; 1] {
        [LinearTerm::effort("fa").coefficient()]
    }
    fn shape(&self) -> [ShapeTerm; 1] {
        [ShapeTerm::per_speed("fb", 1.0, 100.0)]
    }
    #[inline(always)]
    fn columns<S: Scalar>(&self, v: Velocity<S>, [fb]: [S; 1]) -> [S; 1] {
        [(fb * v.value()).arctangent()]
    }
}
