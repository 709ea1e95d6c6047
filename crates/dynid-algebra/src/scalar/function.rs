//! Functions of one and two numbers that every kind of [`Scalar`](super::Scalar) can be put through.
//!
//! A function says its value and its derivatives once, as plain numbers; lanes apply the value, dual numbers and jets the
//! chain rule. Where a function has a kink, its derivative is the mean of both sides.

use super::elementary::{self, decay, logistic_slope};

/// A function of one number with its first two derivatives, for [`Scalar::through`](super::Scalar::through).
///
/// All three and everything that they call should be `#[inline(always)]`, so that columns of samples are computed in wide
/// registers.
pub trait Function: Copy {
    /// `f(x)`.
    fn value(self, x: f64) -> f64;
    /// `f'(x)`. `f`: the value there.
    fn slope(self, x: f64, f: f64) -> f64;
    /// `f''(x)`. `f`: the value there.
    fn bend(self, x: f64, f: f64) -> f64;
}

/// A function of two numbers with its first and second derivatives, for
/// [`Scalar::through_two`](super::Scalar::through_two).
pub trait FunctionOfTwo: Copy {
    /// `f(x, y)`.
    fn value(self, x: f64, y: f64) -> f64;
    /// `∂f/∂x`. `f`: the value there.
    fn by_first(self, x: f64, y: f64, f: f64) -> f64;
    /// `∂f/∂y`. `f`: the value there.
    fn by_second(self, x: f64, y: f64, f: f64) -> f64;
    /// `∂²f/∂x²`, `∂²f/∂x∂y`, `∂²f/∂y²`. `f`: the value there.
    fn bends(self, x: f64, y: f64, f: f64) -> [f64; 3];
}

/// Sign with `s(0) = 0`; its derivative is 0.
#[inline(always)]
pub fn sign(v: f64) -> f64 {
    if v > 0.0 {
        1.0
    } else if v < 0.0 {
        -1.0
    } else {
        0.0
    }
}

/// A [`Function`] from its three formulas over `x` and the value `f`.
macro_rules! function {
    ($(#[$doc:meta])* $name:ident, |$x:ident, $f:ident| $value:expr, $slope:expr, $bend:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub(super) struct $name;
        impl Function for $name {
            #[inline(always)]
            fn value(self, $x: f64) -> f64 {
                $value
            }
            #[inline(always)]
            fn slope(self, $x: f64, $f: f64) -> f64 {
                // Some derivatives need the value alone, some not.
                let _ = ($x, $f);
                $slope
            }
            #[inline(always)]
            fn bend(self, $x: f64, $f: f64) -> f64 {
                let _ = ($x, $f);
                $bend
            }
        }
    };
}

function!(
    /// `|x|`.
    Magnitude, |x, f| x.abs(), sign(x), 0.0
);
function!(
    /// The sign itself.
    Sign, |x, f| sign(x), 0.0, 0.0
);
function!(
    /// Arctangent.
    Arctangent, |x, f| elementary::atan(x), 1.0 / (1.0 + x * x), {
        let slope = 1.0 / (1.0 + x * x);
        -2.0 * x * slope * slope
    }
);
function!(
    /// Hyperbolic tangent.
    Hyperbolic, |x, f| elementary::tanh(x), (1.0 - f) * (1.0 + f), -2.0 * f * ((1.0 - f) * (1.0 + f))
);
function!(
    /// Logistic function, `S' = S (1 - S)`, `S'' = S' (1 - 2 S)`.
    Logistic, |x, f| elementary::logistic(x), logistic_slope(x), logistic_slope(x) * (1.0 - 2.0 * f)
);
function!(
    /// `e^-x` for `x >= 0`.
    Decay, |x, f| decay(x), -f, f
);
function!(
    /// `1 - e^-x` for `x >= 0`, exact for small `x` too.
    Rise, |x, f| elementary::rise(x), decay(x), -decay(x)
);
function!(
    /// `e^x`.
    Exponential, |x, f| x.exp(), f, f
);
function!(
    /// Natural logarithm.
    Logarithm, |x, f| x.ln(), 1.0 / x, -1.0 / (x * x)
);
function!(
    /// Square root.
    Root, |x, f| x.sqrt(), 0.5 / f, -0.25 / (f * x)
);

/// `tanh(x / width)`, a sign that is smooth over `width`.
#[derive(Clone, Copy, Debug)]
pub struct SmoothSign {
    /// Above 0.
    pub width: f64,
}

impl Function for SmoothSign {
    #[inline(always)]
    fn value(self, x: f64) -> f64 {
        (x / self.width).tanh()
    }
    #[inline(always)]
    fn slope(self, _: f64, f: f64) -> f64 {
        (1.0 - f * f) / self.width
    }
    #[inline(always)]
    fn bend(self, x: f64, f: f64) -> f64 {
        -2.0 * f * self.slope(x, f) / self.width
    }
}

/// `max(x, bound)`, or with `above` `min(x, bound)`; beyond the bound the derivative is 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clamp {
    pub(super) bound: f64,
    pub(super) above: bool,
}

impl Function for Clamp {
    #[inline(always)]
    fn value(self, x: f64) -> f64 {
        if self.above { x.min(self.bound) } else { x.max(self.bound) }
    }
    #[inline(always)]
    fn slope(self, x: f64, _: f64) -> f64 {
        0.5 * (1.0 + if self.above { sign(self.bound - x) } else { sign(x - self.bound) })
    }
    #[inline(always)]
    fn bend(self, _: f64, _: f64) -> f64 {
        0.0
    }
}

/// `x^p` for `x >= 0`, without a power where there is a cheaper way.
///
/// At `x = 0` derivatives that are infinite count as 0: for `p < 1` the one by `x`, for `p < 2` the second one. `x^p ln x` goes
/// to 0 with `x`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Power;

impl FunctionOfTwo for Power {
    // What is dear stands before the choices, which are then no branches; where the exponent is known, it is not computed.
    #[inline(always)]
    fn value(self, x: f64, p: f64) -> f64 {
        let any = elementary::power(x, p);
        if p == 2.0 {
            x * x
        } else if p == 1.0 {
            x
        } else {
            any
        }
    }
    #[inline(always)]
    fn by_first(self, x: f64, p: f64, f: f64) -> f64 {
        let any = p * f / x;
        if p == 2.0 {
            2.0 * x
        } else if p == 1.0 {
            1.0
        } else if x > 0.0 {
            any
        } else {
            0.0
        }
    }
    #[inline(always)]
    fn by_second(self, x: f64, _: f64, f: f64) -> f64 {
        let logarithm = elementary::logarithm(x);
        if x > 0.0 { f * logarithm } else { 0.0 }
    }
    #[inline(always)]
    fn bends(self, x: f64, p: f64, f: f64) -> [f64; 3] {
        if x > 0.0 {
            let (log, per) = (elementary::logarithm(x), f / x);
            [p * (p - 1.0) * per / x, per * (1.0 + p * log), f * log * log]
        } else {
            [if p == 2.0 { 2.0 } else { 0.0 }, if p == 1.0 { 1.0 } else { 0.0 }, 0.0]
        }
    }
}
