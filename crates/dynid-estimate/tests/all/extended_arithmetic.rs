//! Double-double arithmetic against exact integers.

use crate::extended::DoubleDouble;
use proptest::prelude::*;

/// The integer nearest to `value`; both parts are integers where these tests need the last digit.
fn integer(value: DoubleDouble) -> i128 {
    value.to_f64() as i128 + value.low() as i128
}

/// An integer below 2^106 as the pair that holds it.
fn pair(value: i128) -> DoubleDouble {
    let high = value as f64;
    DoubleDouble::sum_of(high, (value - high as i128) as f64)
}

/// `bound · 2⁻¹⁰⁶` relative, plus half a unit for results that are not integers.
fn within(found: i128, exact: i128, bound: i128) -> bool {
    (found - exact).abs() <= (exact.abs() >> 106) * bound + bound
}

fn bits(bits: u32) -> impl Strategy<Value = i128> {
    (any::<i128>(), 1..=bits).prop_map(|(draw, bits)| draw >> (128 - bits))
}

/// Doubles that are integers times a power of two within ±30, so that sums stay below 2^127 in units of 2^-30.
fn doubles() -> impl Strategy<Value = f64> {
    (bits(54), -30..=30_i32).prop_map(|(mantissa, exponent)| mantissa as f64 * 2_f64.powi(exponent))
}

proptest! {
    #[test]
    fn sums_of_doubles_are_exact(a in doubles(), b in doubles()) {
        let units = |v: f64| (v * 2_f64.powi(30)) as i128;
        let sum = DoubleDouble::sum_of(a, b);
        prop_assert_eq!(sum.to_f64(), a + b);
        prop_assert_eq!(units(sum.to_f64()) + units(sum.low()), units(a) + units(b));
    }

    #[test]
    fn products_of_doubles_are_exact(a in bits(54), b in bits(54)) {
        let (a, b) = (a as f64, b as f64);
        let product = DoubleDouble::product_of(a, b);
        prop_assert_eq!(product.to_f64(), a * b);
        prop_assert_eq!(integer(product), a as i128 * b as i128);
    }

    #[test]
    fn sums_hold_three_ulps_even_under_cancellation(a in bits(106), b in bits(106), c in bits(80)) {
        let difference = pair(a) - pair(b);
        prop_assert!(within(integer(difference), integer(pair(a)) - integer(pair(b)), 3));
        let near = integer(pair(a)) - c;
        prop_assert!(within(integer(pair(a) + pair(-near)), integer(pair(a)) - integer(pair(near)), 3));
    }

    #[test]
    fn products_hold_five_ulps(a in bits(63), b in bits(63)) {
        prop_assert!(within(integer(pair(a) * pair(b)), a * b, 5));
    }

    #[test]
    fn quotients_hold_fifteen_ulps(quotient in bits(61), divisor in bits(44)) {
        prop_assume!(divisor != 0);
        let found = pair(quotient * divisor) / pair(divisor);
        let error = found - pair(quotient);
        prop_assert!(error.abs().to_f64() <= 15.0 * 2_f64.powi(-106) * quotient.abs() as f64);
    }

    #[test]
    fn square_roots_square_back(a in 1e-100..1e100_f64, b in -1.0..1.0_f64) {
        let a = DoubleDouble::sum_of(a, a * b * 2_f64.powi(-53));
        let root = a.sqrt();
        // Twice the 4 of the root and the 5 of the product.
        prop_assert!((root * root - a).abs().to_f64() <= 13.0 * 2_f64.powi(-106) * a.to_f64());
    }
}

#[test]
fn known_constants() {
    // √2 and 1/3 to 32 digits.
    let near = |found: DoubleDouble, high: f64, low: f64| {
        (found - DoubleDouble::sum_of(high, low)).abs().to_f64() <= 4.0 * 2_f64.powi(-106) * high
    };
    let root = DoubleDouble::from(2.0).sqrt();
    assert!(near(root, std::f64::consts::SQRT_2, -9.667_293_313_452_913e-17), "{root:?}");
    let third = DoubleDouble::ONE / DoubleDouble::from(3.0);
    assert!(near(third, 1.0 / 3.0, 1.850_371_707_708_594e-17), "{third:?}");
    assert_eq!(DoubleDouble::ZERO.sqrt(), DoubleDouble::ZERO);
}
