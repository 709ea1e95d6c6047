//! Double-double arithmetic: some 32 digits from pairs of doubles.
//!
//! Sums and products of two doubles split without error into a rounded part and its rounding error; all else
//! follows from these two. Bounds below are relative, in `u = 2⁻⁵³`, and hold while neither overflow nor underflow
//! (of the rounding errors, about 1e-292 for products) occurs.
//!
//! Sources: Dekker 1971, *A floating-point technique for extending the available precision*; Hida, Li & Bailey
//! 2001, *Algorithms for quad-double precision floating point arithmetic*; bounds: Joldes, Muller & Popescu 2017,
//! *Tight and rigorous error bounds for basic building blocks of double-word arithmetic*.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Unevaluated sum `high + low` of two doubles, `high` being the sum rounded to double.
#[derive(Debug, Clone, Copy, Default, PartialEq, PartialOrd)]
pub(crate) struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// Zero.
    pub(crate) const ZERO: Self = Self { high: 0.0, low: 0.0 };
    /// One.
    pub(crate) const ONE: Self = Self { high: 1.0, low: 0.0 };

    /// `a + b` without error (Knuth's two-sum).
    pub(crate) fn sum_of(a: f64, b: f64) -> Self {
        let high = a + b;
        let of_b = high - a;
        Self { high, low: (a - (high - of_b)) + (b - of_b) }
    }

    /// `a · b` without error (by a fused multiply-add).
    pub(crate) fn product_of(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: a.mul_add(b, -high) }
    }

    /// `a + b` without error for `|a| ≥ |b|` or `a = 0` (Dekker's fast two-sum).
    fn renormalised(a: f64, b: f64) -> Self {
        let high = a + b;
        Self { high, low: b - (high - a) }
    }

    /// The nearest double.
    pub(crate) fn to_f64(self) -> f64 {
        self.high
    }

    /// Correction that [`Self::to_f64`] leaves out, at most half a unit in its last place.
    pub(crate) fn low(self) -> f64 {
        self.low
    }

    /// Magnitude, exact.
    pub(crate) fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// Square root of a number that is not negative, within `4 u²`: one Newton step from the root of `high`.
    pub(crate) fn sqrt(self) -> Self {
        if self.high == 0.0 {
            return Self::ZERO;
        }
        let root = self.high.sqrt();
        let rest = self - Self::product_of(root, root);
        Self::renormalised(root, rest.high / (2.0 * root))
    }
}

impl From<f64> for DoubleDouble {
    fn from(value: f64) -> Self {
        Self { high: value, low: 0.0 }
    }
}

impl Neg for DoubleDouble {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

/// Within `3 u²` of the sum, also under cancellation.
impl Add for DoubleDouble {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let high = Self::sum_of(self.high, other.high);
        let low = Self::sum_of(self.low, other.low);
        let sum = Self::renormalised(high.high, high.low + low.high);
        Self::renormalised(sum.high, sum.low + low.low)
    }
}

/// Within `3 u²` of the difference, also under cancellation.
impl Sub for DoubleDouble {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

/// Within `5 u²` of the product.
impl Mul for DoubleDouble {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let high = Self::product_of(self.high, other.high);
        let cross = self.high * other.low + self.low * other.high;
        Self::renormalised(high.high, high.low + cross)
    }
}

/// Within `15 u²` of the quotient: long division with two digits in base 2⁵³.
impl Div for DoubleDouble {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * Self::from(first);
        Self::renormalised(first, rest.high / other.high)
    }
}
