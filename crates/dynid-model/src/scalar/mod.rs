//! Number types that the dynamics recursion runs on.

mod dispatch;
mod dual;
pub(crate) mod elementary;
mod jet;
mod lanes;
mod sine;

pub(crate) use dispatch::{FusedTask, run_fused};
pub use dispatch::{LANES, LaneTask, run_on_lanes};
pub use dual::Dual;
pub use jet::Jet;
pub use lanes::Lanes;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A number for the dynamics recursion: `f64`, SIMD lanes, dual numbers, jets.
pub trait Scalar:
    Copy + Debug + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + AddAssign
{
    /// Twin of this kind of number with fused multiply-add, for code that runs where the processor has it.
    type Fused: Scalar;
    /// Returns the number as its fused twin.
    fn fuse(self) -> Self::Fused;
    /// Back from the fused twin.
    fn unfuse(fused: Self::Fused) -> Self;
    /// A constant.
    fn from_f64(value: f64) -> Self;
    /// `1 / self`.
    fn recip(self) -> Self;
    /// True if the value (of every lane) is positive and finite.
    fn is_positive_finite(self) -> bool;
    /// Sine and cosine of an angle in rad.
    fn sin_cos(self) -> (Self, Self);
    /// Sines and cosines of several angles, the same numbers as one by one.
    #[inline(always)]
    fn sin_cos_all(angles: &[Self], out: &mut [(Self, Self)]) {
        for (angle, pair) in angles.iter().zip(out) {
            *pair = angle.sin_cos();
        }
    }

    /// Zero.
    #[inline(always)]
    fn zero() -> Self {
        Self::from_f64(0.0)
    }
    /// One.
    #[inline(always)]
    fn one() -> Self {
        Self::from_f64(1.0)
    }
    /// `self * factor + term`, fused where that is faster.
    #[inline(always)]
    fn mul_add(self, factor: Self, term: Self) -> Self {
        self * factor + term
    }
    /// `self * factor - term`, fused where that is faster.
    #[inline(always)]
    fn mul_sub(self, factor: Self, term: Self) -> Self {
        self * factor - term
    }
}

impl Scalar for f64 {
    type Fused = Lanes<1, true>;
    #[inline(always)]
    fn fuse(self) -> Lanes<1, true> {
        Lanes([self])
    }
    #[inline(always)]
    fn unfuse(fused: Lanes<1, true>) -> Self {
        fused.0[0]
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }
    #[inline(always)]
    fn is_positive_finite(self) -> bool {
        self > 0.0 && self.is_finite()
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        sine::sin_cos(self)
    }
}
