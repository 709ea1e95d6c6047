//! Dual numbers: a value with its directional derivatives.

use std::array::from_fn;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Function, FunctionOfTwo, Scalar};

/// `value + Σₖ derivativeₖ εₖ` with `εᵢ εⱼ = 0`: exact first derivatives in `N` directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize> {
    /// The value.
    pub value: f64,
    /// Derivatives along the `N` directions.
    pub derivative: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A variable: derivative 1 along direction `direction`.
    pub fn variable(value: f64, direction: usize) -> Self {
        Dual { value, derivative: from_fn(|k| if k == direction { 1.0 } else { 0.0 }) }
    }

    /// Square root of a positive number.
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        Dual { value: root, derivative: self.derivative.map(|d| 0.5 * d / root) }
    }
}

impl<const N: usize> Scalar for Dual<N> {
    type Fused = Self;
    #[inline(always)]
    fn fuse(self) -> Self {
        self
    }
    #[inline(always)]
    fn unfuse(fused: Self) -> Self {
        fused
    }
    #[inline(always)]
    fn from_f64(value: f64) -> Self {
        Dual { value, derivative: [0.0; N] }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let value = 1.0 / self.value;
        Dual { value, derivative: self.derivative.map(|d| -value * value * d) }
    }
    #[inline(always)]
    fn is_positive_finite(self) -> bool {
        self.value.is_positive_finite()
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.value);
        (
            Dual { value: s, derivative: self.derivative.map(|d| c * d) },
            Dual { value: c, derivative: self.derivative.map(|d| -s * d) },
        )
    }
    #[inline(always)]
    fn through(self, function: impl Function) -> Self {
        let value = function.value(self.value);
        let slope = function.slope(self.value, value);
        Dual { value, derivative: from_fn(|k| slope * self.derivative[k]) }
    }
    #[inline(always)]
    fn through_two(self, second: Self, function: impl FunctionOfTwo) -> Self {
        let (x, y) = (self.value, second.value);
        let value = function.value(x, y);
        let first = product(&self.derivative, || function.by_first(x, y, value));
        let second = product(&second.derivative, || function.by_second(x, y, value));
        Dual { value, derivative: from_fn(|k| first[k] + second[k]) }
    }
}

/// `slope · derivative`; along directions that do not move the argument the slope, however dear or infinite, counts nothing.
#[inline(always)]
fn product<const N: usize>(derivative: &[f64; N], slope: impl Fn() -> f64) -> [f64; N] {
    match derivative.iter().all(|d| *d == 0.0) {
        true => [0.0; N],
        false => {
            let slope = slope();
            from_fn(|k| slope * derivative[k])
        }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Dual { value: self.value + o.value, derivative: from_fn(|k| self.derivative[k] + o.derivative[k]) }
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Dual { value: self.value - o.value, derivative: from_fn(|k| self.derivative[k] - o.derivative[k]) }
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    #[inline(always)]
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the product rule adds")]
    fn mul(self, o: Self) -> Self {
        Dual {
            value: self.value * o.value,
            derivative: from_fn(|k| self.derivative[k] * o.value + self.value * o.derivative[k]),
        }
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    #[expect(clippy::suspicious_arithmetic_impl, reason = "the quotient rule subtracts a product")]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        Dual { value, derivative: from_fn(|k| (self.derivative[k] - value * o.derivative[k]) / o.value) }
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Dual { value: -self.value, derivative: self.derivative.map(|d| -d) }
    }
}

impl<const N: usize> AddAssign for Dual<N> {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
