//! The spring of a harmonic drive.

use dynid_algebra::scalar::Jet;

/// Spring with torque `T = k1 Δ + k2 Δ³` over the deformation `Δ` (rad, N m; or m, N).
///
/// Source: Sun, Shi, Zhang, Wang & Liu, *Parameters Identification Applied to Large Space Robotic Manipulators*, Eqs. 9, 10
/// (there on the motor's side) and 22 to 45 (on the joint's side, as here).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CubicSpring {
    /// Stiffness at rest `k1`, N m/rad or N/m, above 0.
    pub k1: f64,
    /// Cubic stiffness `k2`, N m/rad³ or N/m³; negative: the spring softens.
    pub k2: f64,
}

/// `√27/2`: the cubic's scale of torque over that of its linear part.
const SCALE: f64 = 2.598_076_211_353_316;

impl CubicSpring {
    /// `T = k1 Δ + k2 Δ³`.
    pub fn torque(&self, deformation: f64) -> f64 {
        deformation * (self.k1 + self.k2 * deformation * deformation)
    }

    /// `dT/dΔ = k1 + 3 k2 Δ²`.
    pub fn stiffness(&self, deformation: f64) -> f64 {
        self.k1 + 3.0 * self.k2 * deformation * deformation
    }

    /// `d²T/dΔ² = 6 k2 Δ`.
    pub fn stiffness_slope(&self, deformation: f64) -> f64 {
        6.0 * self.k2 * deformation
    }

    /// Energy stored, `k1 Δ²/2 + k2 Δ⁴/4`, J.
    pub fn energy(&self, deformation: f64) -> f64 {
        let square = deformation * deformation;
        square * (0.5 * self.k1 + 0.25 * self.k2 * square)
    }

    /// Deformation under a torque, on the branch through rest.
    ///
    /// With `x = T/k1` and `y = (√27/2) √(|k2| x²/k1)`: `Δ = x · 3 sinh(asinh(y)/3)/y` for `k2 > 0`, `Δ = x` for `k2 = 0`,
    /// `Δ = x · 3 sin(asin(y)/3)/y` for `k2 < 0`. Relative error a few units of rounding times
    /// `1 + ln(1 + y)/3`; next to the peak of a softening
    /// spring, where its stiffness vanishes, the root of that.
    ///
    /// `None`: a softening spring that cannot carry the torque, `|T|` above `(2/3) k1 Δ` at
    /// [`CubicSpring::largest_deformation`]; `k1` not positive; a number that is not finite, or so large that
    /// the result is none.
    pub fn deformation(&self, torque: f64) -> Option<f64> {
        if !(self.k1 > 0.0 && self.k1.is_finite() && self.k2.is_finite() && torque.is_finite()) {
            return None;
        }
        let linear = torque / self.k1;
        let y = SCALE * (self.k2.abs() / self.k1).sqrt() * linear.abs();
        let share = if y == 0.0 {
            1.0
        } else if self.k2 > 0.0 {
            3.0 * (y.asinh() / 3.0).sinh() / y
        } else if y <= 1.0 {
            3.0 * (y.asin() / 3.0).sin() / y
        } else {
            return None;
        };
        Some(linear * share).filter(|x| x.is_finite())
    }

    /// [`CubicSpring::deformation`] with its time derivatives, `Δ̇ = Ṫ/S` and `Δ̈ = (T̈ - 6 k2 Δ Δ̇²)/S`, `S` the stiffness at
    /// `Δ`; `None` also where that is not positive.
    pub fn deformation_jet(&self, torque: Jet) -> Option<Jet> {
        let value = self.deformation(torque.value)?;
        let stiffness = self.stiffness(value);
        let first = torque.first / stiffness;
        let second = (torque.second - self.stiffness_slope(value) * first * first) / stiffness;
        (stiffness > 0.0).then_some(Jet { value, first, second })
    }

    /// Deformation up to which the torque grows: `√(k1/(3 |k2|))` for a spring that softens, infinite otherwise; 0 unless
    /// `k1 > 0`.
    pub fn largest_deformation(&self) -> f64 {
        match (self.k1 > 0.0, self.k2 < 0.0) {
            (false, _) => 0.0,
            (true, true) => (self.k1 / (-3.0 * self.k2)).sqrt(),
            (true, false) => f64::INFINITY,
        }
    }

    /// Whether the torque grows with the deformation everywhere up to `±deformation`: `k1 > 0` and
    /// `k2 > -k1/(3 deformation²)`. Energy then only ever flows into the spring as it is wound up.
    pub fn is_passive(&self, deformation: f64) -> bool {
        self.k1 > 0.0 && self.k2 > Self::least_k2(self.k1, deformation)
    }

    /// `-k1/(3 Δ²)`: what `k2` must exceed for a torque that grows up to `±deformation`.
    pub fn least_k2(k1: f64, deformation: f64) -> f64 {
        -k1 / (3.0 * deformation * deformation)
    }

    /// Returns the spring as the motor sees it through a ratio `N`: `k1/N²`, `k2/N⁴` (torque on the motor over motor angle).
    pub fn motor_side(&self, ratio: f64) -> CubicSpring {
        let square = ratio * ratio;
        CubicSpring { k1: self.k1 / square, k2: self.k2 / (square * square) }
    }

    /// From the motor's side back: `k1 N²`, `k2 N⁴`.
    pub fn joint_side(&self, ratio: f64) -> CubicSpring {
        let square = ratio * ratio;
        CubicSpring { k1: self.k1 * square, k2: self.k2 * square * square }
    }
}
