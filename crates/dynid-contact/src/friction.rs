//! Sliding friction of the journal.

use crate::error::{ContactError, checked};

/// Coulomb friction without its jump: `F_t = -μ c_d(|v|) sign(v) F_n`.
///
/// `c_d = 0` up to the speed `v_0`, `(|v| - v_0)/(v_m - v_0)` up to `v_m`, 1 beyond. Both are tolerances that keep the force
/// from chattering about rest, not properties of the surfaces; `v_m` must be well below the speeds of interest.
///
/// Default: `μ = 0.1`, `v_0 = 1e-5` m/s, `v_m = 1e-4` m/s.
///
/// Source: Ambrósio, *Impact of rigid and flexible multibody systems: deformation description and contact models* (2003).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlidingFriction {
    /// Coefficient `μ`, at least 0.
    pub coefficient: f64,
    /// Speed up to which there is no friction, m/s.
    pub v_0: f64,
    /// Speed from which there is all of it, m/s.
    pub v_m: f64,
}

impl Default for SlidingFriction {
    fn default() -> Self {
        SlidingFriction { coefficient: 0.1, v_0: 1e-5, v_m: 1e-4 }
    }
}

impl SlidingFriction {
    /// Fails unless `coefficient >= 0` and `0 <= v_0 < v_m`, all finite.
    pub fn new(coefficient: f64, v_0: f64, v_m: f64) -> Result<Self, ContactError> {
        checked("coefficient", "at least 0", coefficient, coefficient >= 0.0)?;
        checked("v_0", "at least 0 m/s", v_0, v_0 >= 0.0)?;
        checked("v_m", "a speed in m/s above `v_0`", v_m, v_m > v_0)?;
        Ok(SlidingFriction { coefficient, v_0, v_m })
    }

    /// `c_d(|v|) sign(v)` and its derivative by `v`, which is 0 outside the ramp.
    #[inline]
    pub fn direction(&self, v: f64) -> (f64, f64) {
        let speed = v.abs();
        if speed <= self.v_0 {
            (0.0, 0.0)
        } else if speed < self.v_m {
            let slope = 1.0 / (self.v_m - self.v_0);
            (((speed - self.v_0) * slope).copysign(v), slope)
        } else {
            (1.0_f64.copysign(v), 0.0)
        }
    }
}
