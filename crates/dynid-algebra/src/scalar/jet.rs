//! Jets: a value with its first two time derivatives.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::{Function, FunctionOfTwo, Scalar};

/// Value, first and second time derivative of a signal, carried exactly through any formula (a Taylor polynomial of order
/// two).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// Value.
    pub value: f64,
    /// First derivative by time.
    pub first: f64,
    /// Second derivative by time.
    pub second: f64,
}

impl Jet {
    /// From value, first and second derivative.
    #[inline]
    pub fn new([value, first, second]: [f64; 3]) -> Self {
        Jet { value, first, second }
    }

    /// Value, first and second derivative.
    #[inline]
    pub fn derivatives(self) -> [f64; 3] {
        [self.value, self.first, self.second]
    }

    /// A function of the signal, from the function's value and first two derivatives at [`Jet::value`].
    #[inline(always)]
    pub fn composed(self, [f, slope, bend]: [f64; 3]) -> Self {
        Jet {
            value: f,
            first: slope * self.first,
            second: bend * self.first * self.first + slope * self.second,
        }
    }

    /// Times a constant.
    #[inline(always)]
    pub fn scaled(self, factor: f64) -> Self {
        Jet { value: factor * self.value, first: factor * self.first, second: factor * self.second }
    }
}

impl Scalar for Jet {
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
        Jet { value, first: 0.0, second: 0.0 }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let value = 1.0 / self.value;
        self.composed([value, -value * value, 2.0 * value * value * value])
    }
    #[inline(always)]
    fn is_positive_finite(self) -> bool {
        self.value.is_positive_finite()
    }
    #[inline(always)]
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = Scalar::sin_cos(self.value);
        (self.composed([s, c, -s]), self.composed([c, -s, -c]))
    }
    #[inline(always)]
    fn through(self, function: impl Function) -> Self {
        let f = function.value(self.value);
        self.composed([f, function.slope(self.value, f), function.bend(self.value, f)])
    }
    #[inline(always)]
    fn through_two(self, o: Self, function: impl FunctionOfTwo) -> Self {
        let (x, y) = (self.value, o.value);
        let f = function.value(x, y);
        let (by_x, by_y) = (function.by_first(x, y, f), function.by_second(x, y, f));
        let [xx, xy, yy] = function.bends(x, y, f);
        let bent = xx * self.first * self.first + 2.0 * xy * self.first * o.first + yy * o.first * o.first;
        Jet {
            value: f,
            first: by_x * self.first + by_y * o.first,
            second: bent + by_x * self.second + by_y * o.second,
        }
    }
}

impl Div for Jet {
    type Output = Self;
    #[inline]
    fn div(self, o: Self) -> Self {
        let value = self.value / o.value;
        let first = (self.first - value * o.first) / o.value;
        Jet { value, first, second: (self.second - 2.0 * first * o.first - value * o.second) / o.value }
    }
}

impl Add for Jet {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Jet { value: self.value + o.value, first: self.first + o.first, second: self.second + o.second }
    }
}

impl Sub for Jet {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Jet { value: self.value - o.value, first: self.first - o.first, second: self.second - o.second }
    }
}

impl Mul for Jet {
    type Output = Self;
    #[inline(always)]
    fn mul(self, o: Self) -> Self {
        Jet {
            value: self.value * o.value,
            first: self.first * o.value + self.value * o.first,
            second: self.second * o.value + 2.0 * self.first * o.first + self.value * o.second,
        }
    }
}

impl Neg for Jet {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.scaled(-1.0)
    }
}

impl AddAssign for Jet {
    #[inline(always)]
    fn add_assign(&mut self, o: Self) {
        *self = *self + o;
    }
}
