//! Arctangent, logarithm, decaying exponential and what is made of them, without branches, so that lanes stay in step.
//!
//! Polynomials of fdlibm (Sun Microsystems 1993) after reductions that need no branch. Errors stay within 2 units in the last
//! place (`1e-16` absolute where a value is the difference of two). No product is fused with a sum, so that every
//! processor gives the same bits; AVX2 only makes the lanes wider.

const ARCTANGENT: [f64; 11] = [
    3.333_333_333_333_293e-1,
    -1.999_999_999_987_648_3e-1,
    1.428_571_427_250_346_6e-1,
    -1.111_111_040_546_235_6e-1,
    9.090_887_133_436_507e-2,
    -7.691_876_205_044_83e-2,
    6.661_073_137_387_531e-2,
    -5.833_570_133_790_573_5e-2,
    4.976_877_994_615_932_4e-2,
    -3.653_157_274_421_691_6e-2,
    1.628_582_011_536_578_2e-2,
];
/// `tan(π/8)` and `tan(3π/8)`: between them an angle is taken from `π/4`, above from `π/2`.
const TAN_LOW: f64 = 0.414_213_562_373_095_03;
const TAN_HIGH: f64 = 2.414_213_562_373_095;
// What π/2 and π/4 lack as numbers.
const HALF_PI_REST: f64 = 6.123_233_995_736_766e-17;
const QUARTER_PI_REST: f64 = 3.061_616_997_868_383e-17;

/// Arctangent.
#[inline(always)]
pub(super) fn atan(x: f64) -> f64 {
    let a = x.abs();
    let (high, middle) = (a > TAN_HIGH, a > TAN_LOW);
    let above = if high {
        -1.0
    } else if middle {
        a - 1.0
    } else {
        a
    };
    let below = if high {
        a
    } else if middle {
        a + 1.0
    } else {
        1.0
    };
    let (base, rest) = if high {
        (std::f64::consts::FRAC_PI_2, HALF_PI_REST)
    } else if middle {
        (std::f64::consts::FRAC_PI_4, QUARTER_PI_REST)
    } else {
        (0.0, 0.0)
    };
    let t = above / below;
    let z = t * t;
    let w = z * z;
    let c = &ARCTANGENT;
    let odd = z * (c[0] + w * (c[2] + w * (c[4] + w * (c[6] + w * (c[8] + w * c[10])))));
    let even = w * (c[1] + w * (c[3] + w * (c[5] + w * (c[7] + w * c[9]))));
    let angle = base - ((t * (odd + even) - rest) - t);
    angle.copysign(x)
}

const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Adding this rounds to an integer, which then sits in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// Beyond this `e^-x` is no normal number.
const DECAYED: f64 = 708.0;
const EXPONENTIAL: [f64; 5] = [
    1.666_666_666_666_660_2e-1,
    -2.777_777_777_701_559_3e-3,
    6.613_756_321_437_934e-5,
    -1.653_390_220_546_525_2e-6,
    4.138_136_797_057_238_5e-8,
];

/// `e^-x = 2^k (1 + p)`: `2^k` and `p`, for `0 <= x <= DECAYED`.
#[inline(always)]
fn decay_parts(x: f64) -> (f64, f64) {
    let rounded = x * -std::f64::consts::LOG2_E + ROUND;
    let k = rounded - ROUND;
    let high = -x - k * LN_2_HIGH;
    let low = k * LN_2_LOW;
    let r = high - low;
    let t = r * r;
    let p = &EXPONENTIAL;
    let c = r - t * (p[0] + t * (p[1] + t * (p[2] + t * (p[3] + t * p[4]))));
    let scale = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    (scale, high - (low - r * c / (2.0 - c)))
}

/// `e^-x` for `x >= 0`; 0 where that is below some `1e-308`.
#[inline(always)]
pub(super) fn decay(x: f64) -> f64 {
    let beyond = x > DECAYED;
    let (scale, p) = decay_parts(if beyond { DECAYED } else { x });
    if beyond { 0.0 } else { scale + scale * p }
}

/// `1 - e^-x` for `x >= 0`, exact for small `x` too.
#[inline(always)]
pub(super) fn rise(x: f64) -> f64 {
    // From 40 on the result is 1.
    let (scale, p) = decay_parts(if x > 40.0 { 40.0 } else { x });
    -(scale * p + (scale - 1.0))
}

const LOGARITHM: [f64; 7] = [
    6.666_666_666_666_735e-1,
    3.999_999_999_940_942e-1,
    2.857_142_874_366_239e-1,
    2.222_219_843_214_978_4e-1,
    1.818_357_216_161_805e-1,
    1.531_383_769_920_937_3e-1,
    1.479_819_860_511_658_6e-1,
];
/// Bits of a number just below `√½`, from where on mantissas count.
const ROOT_HALF: u64 = 0x3fe6_a09e_0000_0000;
const ONE: u64 = 0x3ff0_0000_0000_0000;
/// An integer below `2^52` in the low bits of this is that integer and `2^52` as a number.
const INTEGER: u64 = 0x4330_0000_0000_0000;
/// `2^54`, which makes any number a normal one.
const NORMAL: f64 = 18_014_398_509_481_984.0;

/// Natural logarithm for finite `x >= 0`; minus infinity at 0.
#[inline(always)]
pub(super) fn logarithm(x: f64) -> f64 {
    let small = x < f64::MIN_POSITIVE;
    let bits = (if small { x * NORMAL } else { x }).to_bits().wrapping_add(ONE - ROOT_HALF);
    let above = if small { 4_503_599_627_370_496.0 + 1077.0 } else { 4_503_599_627_370_496.0 + 1023.0 };
    let k = f64::from_bits((bits >> 52) | INTEGER) - above;
    let f = f64::from_bits((bits & 0x000f_ffff_ffff_ffff).wrapping_add(ROOT_HALF)) - 1.0;
    let half_square = 0.5 * f * f;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let c = &LOGARITHM;
    let odd = z * (c[0] + w * (c[2] + w * (c[4] + w * c[6])));
    let even = w * (c[1] + w * (c[3] + w * c[5]));
    let found = s * (half_square + (odd + even)) + k * LN_2_LOW - half_square + f + k * LN_2_HIGH;
    if x > 0.0 { found } else { f64::NEG_INFINITY }
}

/// `x^p` for finite `x >= 0` and `p > 0`, as the exponential of a logarithm: relative error about `|p ln x|` units in the last
/// place.
#[inline(always)]
pub(super) fn power(x: f64, p: f64) -> f64 {
    let y = p * logarithm(x);
    let (under, over) = (y < -DECAYED, y > DECAYED);
    let (scale, part) = decay_parts(if under || over { 0.0 } else { -y });
    let within = scale + scale * part;
    let bounded = if under { 0.0 } else { within };
    if over { f64::INFINITY } else { bounded }
}

/// Hyperbolic tangent.
#[inline(always)]
pub(super) fn tanh(x: f64) -> f64 {
    let twice = 2.0 * x.abs();
    // From 80 on the result is 1.
    let (scale, p) = decay_parts(if twice > 80.0 { 80.0 } else { twice });
    let less_one = scale * p + (scale - 1.0);
    (-less_one / (2.0 + less_one)).copysign(x)
}

/// Logistic function `S = 1 / (1 + e^-x)`, which no argument overflows.
#[inline(always)]
pub(super) fn logistic(x: f64) -> f64 {
    let e = decay(x.abs());
    (if x < 0.0 { e } else { 1.0 }) / (1.0 + e)
}

/// Derivative of [`logistic`], `S (1 - S)`.
#[inline(always)]
pub(super) fn logistic_slope(x: f64) -> f64 {
    let e = decay(x.abs());
    e / ((1.0 + e) * (1.0 + e))
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Curve, map_curve};
    use super::*;

    struct Of(fn(f64) -> f64);
    impl Curve for Of {
        #[inline(always)]
        fn at(&self, x: f64) -> f64 {
            (self.0)(x)
        }
    }

    /// Largest error in units in the last place of the expected value, over magnitudes from 1e-9 to 1e3.
    fn worst(found: fn(f64) -> f64, expected: fn(f64) -> f64, arguments: impl Iterator<Item = f64>) -> f64 {
        arguments.fold(0.0, |worst, x| {
            let (f, e) = (found(x), expected(x));
            let ulp = f64::from_bits(e.abs().to_bits() + 1) - e.abs();
            f64::max(worst, (f - e).abs() / ulp)
        })
    }

    fn magnitudes() -> impl Iterator<Item = f64> {
        (-90_000..30_000).flat_map(|k| {
            let x = 10.0_f64.powf(k as f64 * 1e-4);
            [x, -x]
        })
    }

    #[test]
    fn functions_agree_with_the_standard_library() {
        let arctangent = worst(atan, f64::atan, magnitudes());
        assert!(arctangent <= 2.0, "{arctangent}");
        let positive = || magnitudes().filter(|x| *x > 0.0 && *x < DECAYED);
        let exponential = worst(decay, |x| (-x).exp(), positive());
        assert!(exponential <= 2.0, "{exponential}");
        let natural = worst(logarithm, f64::ln, magnitudes().filter(|x| *x > 0.0));
        assert!(natural <= 2.0, "{natural}");
        let risen = worst(rise, |x| -(-x).exp_m1(), positive());
        assert!(risen <= 2.0, "{risen}");
        for p in [0.3, 1.4, 1.99] {
            for x in positive() {
                let (found, expected) = (power(x, p), x.powf(p));
                let units = 2.0 + (p * x.ln()).abs();
                assert!((found - expected).abs() <= units * f64::EPSILON * expected, "{x}^{p}: {found}");
            }
        }
        // The library's own error is some 2 units here.
        let hyperbolic = worst(tanh, f64::tanh, magnitudes());
        assert!(hyperbolic <= 4.0, "{hyperbolic}");
    }

    #[test]
    fn logistic_function_and_slope_hold_at_any_argument() {
        for x in [-1e300, -800.0, -459.0, -3.0, -1e-9, 0.0, 1e-9, 0.4, 37.0, 459.0, 800.0, 1e300] {
            let (s, slope) = (logistic(x), logistic_slope(x));
            let expected = if x < -700.0 { 0.0 } else { 1.0 / (1.0 + (-x).exp()) };
            assert!((s - expected).abs() <= 4.0 * f64::EPSILON * expected, "{x}: {s} {expected}");
            assert!((logistic(-x) + s - 1.0).abs() <= f64::EPSILON, "{x}");
            let expected = expected * logistic(-x);
            assert!((slope - expected).abs() <= 8.0 * f64::EPSILON * expected, "{x}: {slope} {expected}");
        }
        assert_eq!((logistic(0.0), logistic_slope(0.0)), (0.5, 0.25));
    }

    #[test]
    fn ends_of_the_number_line_hold() {
        assert_eq!((atan(0.0), tanh(0.0), decay(0.0)), (0.0, 0.0, 1.0));
        assert_eq!((atan(f64::INFINITY), atan(-1e300)), (f64::INFINITY.atan(), -f64::INFINITY.atan()));
        assert_eq!((tanh(f64::INFINITY), tanh(-50.0)), (1.0, -1.0));
        assert_eq!((decay(f64::INFINITY), decay(709.0)), (0.0, 0.0));
        assert_eq!((rise(0.0), rise(f64::INFINITY), rise(1e-300)), (0.0, 1.0, 1e-300));
        assert_eq!((logarithm(0.0), logarithm(1.0)), (f64::NEG_INFINITY, 0.0));
        for x in [5e-324, 1e-310, f64::MIN_POSITIVE, f64::MAX] {
            assert!((logarithm(x) - x.ln()).abs() <= 2.0 * f64::EPSILON * x.ln().abs(), "{x}");
        }
        assert_eq!((power(0.0, 0.5), power(1.0, 0.7), power(1e-300, 2.0)), (0.0, 1.0, 0.0));
        assert_eq!(power(1e300, 2.0), f64::INFINITY);
        assert!(atan(f64::NAN).is_nan() && tanh(f64::NAN).is_nan() && decay(f64::NAN).is_nan());
    }

    #[test]
    fn wide_registers_give_the_same_bits() {
        for function in [atan as fn(f64) -> f64, tanh, logistic, logistic_slope, |x| power(x.abs(), 0.7)] {
            let arguments: Vec<f64> = magnitudes().step_by(7).collect();
            let mut values = arguments.clone();
            map_curve(&Of(function), &mut values);
            for (x, value) in arguments.into_iter().zip(values) {
                assert_eq!(value.to_bits(), function(x).to_bits(), "{x}");
            }
        }
    }
}
