//! A value with its derivatives along two directions and the mixed second one.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Function, FunctionOfTwo, Scalar};

/// `value + a ε + b η + ab ε η` with `ε² = η² = 0`: exact mixed second derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cross {
    /// The value.
    pub value: f64,
    /// Derivative along the first direction.
    pub a: f64,
    /// Derivative along the second direction.
    pub b: f64,
    /// Mixed second derivative.
    pub ab: f64,
}

impl Scalar for Cross {
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
        Cross { value, a: 0.0, b: 0.0, ab: 0.0 }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        Self::from_f64(1.0) / self
    }
    #[inline(always)]
    fn is_positive_finite(self) -> bool {
        self.value.is_positive_finite()
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.value);
        let (turned, product) = (self.a * self.b, self.ab);
        (
            Cross { value: s, a: c * self.a, b: c * self.b, ab: c * product - s * turned },
            Cross { value: c, a: -s * self.a, b: -s * self.b, ab: -s * product - c * turned },
        )
    }
    #[inline(always)]
    fn through(self, function: impl Function) -> Self {
        let f = function.value(self.value);
        let slope = function.slope(self.value, f);
        let bend = function.bend(self.value, f);
        Cross { value: f, a: slope * self.a, b: slope * self.b, ab: bend * self.a * self.b + slope * self.ab }
    }
    #[inline(always)]
    fn through_two(self, o: Self, function: impl FunctionOfTwo) -> Self {
        let (x, y) = (self.value, o.value);
        let f = function.value(x, y);
        let (by_x, by_y) = (function.by_first(x, y, f), function.by_second(x, y, f));
        let [xx, xy, yy] = function.bends(x, y, f);
        let bent = xx * self.a * self.b + xy * (self.a * o.b + o.a * self.b) + yy * o.a * o.b;
        Cross {
            value: f,
            a: by_x * self.a + by_y * o.a,
            b: by_x * self.b + by_y * o.b,
            ab: bent + by_x * self.ab + by_y * o.ab,
        }
    }
}

impl Add for Cross {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Cross { value: self.value + o.value, a: self.a + o.a, b: self.b + o.b, ab: self.ab + o.ab }
    }
}

impl Sub for Cross {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        self + -o
    }
}

impl Mul for Cross {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Cross {
            value: self.value * o.value,
            a: self.a * o.value + self.value * o.a,
            b: self.b * o.value + self.value * o.b,
            ab: self.ab * o.value + self.a * o.b + self.b * o.a + self.value * o.ab,
        }
    }
}

impl Div for Cross {
    type Output = Self;
    #[inline(always)]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        let a = (self.a - value * o.a) / o.value;
        let b = (self.b - value * o.b) / o.value;
        Cross { value, a, b, ab: (self.ab - a * o.b - b * o.a - value * o.ab) / o.value }
    }
}

impl Neg for Cross {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Cross { value: -self.value, a: -self.a, b: -self.b, ab: -self.ab }
    }
}

impl AddAssign for Cross {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
