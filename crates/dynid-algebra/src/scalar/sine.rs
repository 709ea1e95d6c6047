//! Sine and cosine without branches, so that lanes stay in step.
//!
//! Cody & Waite reduction by `π/2` in three parts, then the minimax polynomials of fdlibm (Sun Microsystems 1993) on
//! `[-π/4, π/4]`. Error below 2 units in the last place for `|x| <= 1e5`; larger arguments go to the
//! standard library.

/// Beyond this the three-part reduction starts to lose digits.
const REDUCTION_LIMIT: f64 = 1e5;

const TWO_OVER_PI: f64 = std::f64::consts::FRAC_2_PI;
// π/2 split so that products with integers up to 2^20 are exact.
const HALF_PI_HIGH: f64 = 1.570_796_326_734_125_6;
const HALF_PI_MIDDLE: f64 = 6.077_100_506_303_966e-11;
const HALF_PI_LOW: f64 = 2.022_266_248_795_950_6e-21;
/// Adding this rounds to an integer, which then sits in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

const SINE: [f64; 6] = [
    -1.666_666_666_666_663_2e-1,
    8.333_333_333_322_49e-3,
    -1.984_126_982_985_795e-4,
    2.755_731_370_707_006_8e-6,
    -2.505_076_025_340_686e-8,
    1.589_690_995_211_55e-10,
];
const COSINE: [f64; 6] = [
    4.166_666_666_666_66e-2,
    -1.388_888_888_887_411e-3,
    2.480_158_728_947_673e-5,
    -2.755_731_435_139_066_3e-7,
    2.087_572_321_298_175e-9,
    -1.135_964_755_778_819_5e-11,
];

#[inline(always)]
fn fma<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

#[inline(always)]
fn polynomial<const FUSED: bool>(c: &[f64; 6], z: f64) -> f64 {
    let mut sum = c[5];
    for k in (0..5).rev() {
        sum = fma::<FUSED>(sum, z, c[k]);
    }
    sum
}

#[inline(always)]
fn sin_cos_reduced<const FUSED: bool>(x: f64) -> (f64, f64) {
    let rounded = fma::<FUSED>(x, TWO_OVER_PI, ROUND);
    let quadrant = rounded.to_bits();
    let n = rounded - ROUND;
    let r = fma::<FUSED>(-n, HALF_PI_HIGH, x);
    let r = fma::<FUSED>(-n, HALF_PI_MIDDLE, r);
    let r = fma::<FUSED>(-n, HALF_PI_LOW, r);
    let z = r * r;
    let s = fma::<FUSED>(r * z, polynomial::<FUSED>(&SINE, z), r);
    let c = fma::<FUSED>(z * z, polynomial::<FUSED>(&COSINE, z), fma::<FUSED>(z, -0.5, 1.0));
    // Quadrants 1 and 3 exchange sine and cosine; the sign follows from the two low bits.
    let swap = (quadrant & 1).wrapping_neg();
    let (sb, cb) = (s.to_bits(), c.to_bits());
    let sine = (sb & !swap) | (cb & swap);
    let cosine = (cb & !swap) | (sb & swap);
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sine ^ sine_sign), f64::from_bits(cosine ^ cosine_sign))
}

#[inline(always)]
pub(super) fn sin_cos_lanes<const N: usize, const FUSED: bool>(x: [f64; N]) -> ([f64; N], [f64; N]) {
    let mut s = [0.0; N];
    let mut c = [0.0; N];
    let mut largest = 0.0;
    for k in 0..N {
        (s[k], c[k]) = sin_cos_reduced::<FUSED>(x[k]);
        // Passes over NaN, so that it hides no huge argument in another lane.
        largest = if x[k].abs() > largest { x[k].abs() } else { largest };
    }
    if largest > REDUCTION_LIMIT {
        beyond_reduction(&x, &mut s, &mut c);
    }
    (s, c)
}

/// Replaces the lanes concerned, and only these, so that no lane's bits depend on its neighbours.
#[cold]
#[inline(never)]
fn beyond_reduction<const N: usize>(x: &[f64; N], s: &mut [f64; N], c: &mut [f64; N]) {
    for k in 0..N {
        if x[k].abs() > REDUCTION_LIMIT {
            (s[k], c[k]) = x[k].sin_cos();
        }
    }
}

#[inline(always)]
pub(super) fn sin_cos(x: f64) -> (f64, f64) {
    if x.abs() <= REDUCTION_LIMIT { sin_cos_reduced::<false>(x) } else { x.sin_cos() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_standard_library() {
        let mut worst: f64 = 0.0;
        for k in -200_000..200_000 {
            let x = k as f64 * 0.001_37 + 1e-9 * k as f64 * k as f64;
            let (s, c) = sin_cos(x);
            let (se, ce) = x.sin_cos();
            worst = worst.max((s - se).abs()).max((c - ce).abs());
        }
        assert!(worst <= 2.0 * f64::EPSILON, "{worst:e}");
    }

    #[test]
    fn keeps_digits_near_multiples_of_half_pi() {
        for n in [1.0, 7.0, 100.0, 1001.0, 50_000.0] {
            let x = n * std::f64::consts::FRAC_PI_2;
            let (s, c) = sin_cos(x);
            let (se, ce) = x.sin_cos();
            let small = if se.abs() < ce.abs() { (s, se) } else { (c, ce) };
            assert!((small.0 - small.1).abs() <= 1e-9 * small.1.abs() + 1e-19, "{n}: {small:?}");
        }
    }

    #[test]
    fn huge_and_non_finite_arguments_fall_back() {
        let (s, c) = sin_cos(1e12);
        assert_eq!((s, c), 1e12_f64.sin_cos());
        let (s, c) = sin_cos_lanes::<4, false>([0.0, 1e300, 1.0, f64::NAN]);
        assert_eq!((s[1], c[1]), 1e300_f64.sin_cos());
        assert_eq!((s[2], c[2]), sin_cos(1.0));
        assert!(s[3].is_nan() && c[3].is_nan());
        // A NaN in one lane must not hide a huge argument in another.
        let (s, c) = sin_cos_lanes::<4, false>([1e300, f64::NAN, 1.0, 2.0]);
        assert_eq!((s[0], c[0]), 1e300_f64.sin_cos());
    }
}
