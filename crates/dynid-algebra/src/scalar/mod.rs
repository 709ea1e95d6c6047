//! Number types that the dynamics recursion and the laws of elements run on.

mod cross;
mod curve;
mod dispatch;
mod dual;
mod elementary;
mod function;
mod jet;
mod lanes;
mod sine;

pub use cross::Cross;
pub use curve::{Curve, map_curve, map_decay, sin_cos_columns};
pub use dispatch::{FusedTask, run_fused};
pub use dispatch::{LANES, LaneTask, run_on_lanes, run_on_wide_lanes};
pub use dual::Dual;
pub use function::{Function, FunctionOfTwo, SmoothSign, sign};
pub use jet::Jet;
pub use lanes::Lanes;

use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use function::{
    Arctangent, Clamp, Decay, Exponential, Hyperbolic, Logarithm, Logistic, Magnitude, Power, Rise, Root,
    Sign,
};

/// A number for the dynamics recursion and the laws of elements: `f64`, SIMD lanes, dual numbers, jets.
///
/// Code written over it gives values, exact derivatives and time derivatives alike. Where a function has a kink, its
/// derivative is the mean of both sides; that of a sign is 0.
pub trait Scalar:
    Copy
    + Debug
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
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
    /// A function of the number.
    fn through(self, function: impl Function) -> Self;
    /// A function of two numbers.
    fn through_two(self, second: Self, function: impl FunctionOfTwo) -> Self;
    /// Sines and cosines of several angles, the same numbers as one by one.
    #[inline(always)]
    fn sin_cos_all(angles: &[Self], out: &mut [(Self, Self)]) {
        for (angle, pair) in angles.iter().zip(out) {
            *pair = angle.sin_cos();
        }
    }

    /// Magnitude `|x|`.
    #[inline(always)]
    fn magnitude(self) -> Self {
        self.through(Magnitude)
    }
    /// Sign with `s(0) = 0`.
    #[inline(always)]
    fn sign(self) -> Self {
        self.through(Sign)
    }
    /// The greater of the number and a constant.
    #[inline(always)]
    fn at_least(self, bound: f64) -> Self {
        self.through(Clamp { bound, above: false })
    }
    /// The lesser of the number and a constant.
    #[inline(always)]
    fn at_most(self, bound: f64) -> Self {
        self.through(Clamp { bound, above: true })
    }
    /// Square root of a positive number.
    #[inline(always)]
    fn root(self) -> Self {
        self.through(Root)
    }
    /// `x^p` of a number that is not negative. At `x = 0` derivatives that are infinite count as 0.
    #[inline(always)]
    fn power(self, exponent: Self) -> Self {
        self.through_two(exponent, Power)
    }
    /// `e^x`.
    #[inline(always)]
    fn exponential(self) -> Self {
        self.through(Exponential)
    }
    /// `e^-x` of a number that is not negative; 0 from some `x = 708` on. Faster than [`Scalar::exponential`].
    #[inline(always)]
    fn decay(self) -> Self {
        self.through(Decay)
    }
    /// `1 - e^-x` of a number that is not negative, exact for small ones too.
    #[inline(always)]
    fn rise(self) -> Self {
        self.through(Rise)
    }
    /// Natural logarithm of a positive number.
    #[inline(always)]
    fn logarithm(self) -> Self {
        self.through(Logarithm)
    }
    /// Arctangent.
    #[inline(always)]
    fn arctangent(self) -> Self {
        self.through(Arctangent)
    }
    /// Hyperbolic tangent.
    #[inline(always)]
    fn hyperbolic_tangent(self) -> Self {
        self.through(Hyperbolic)
    }
    /// Logistic function `1 / (1 + e^-x)`, which no argument overflows.
    #[inline(always)]
    fn logistic(self) -> Self {
        self.through(Logistic)
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
    #[inline(always)]
    fn through(self, function: impl Function) -> Self {
        function.value(self)
    }
    #[inline(always)]
    fn through_two(self, second: Self, function: impl FunctionOfTwo) -> Self {
        function.value(self, second)
    }
}
