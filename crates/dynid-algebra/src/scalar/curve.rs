//! Functions of one number over columns, in wide registers where the processor has them.

use super::Scalar;
use super::dispatch::{FusedTask, LANES, LaneTask, run_fused, run_on_lanes};
use super::elementary::decay;

/// A function of one number, to be applied to columns.
///
/// `at` and everything that it calls must be `#[inline(always)]`, so that it is compiled once more for wide registers.
pub trait Curve {
    /// The function.
    fn at(&self, x: f64) -> f64;
}

/// Replaces all values by the curve's.
pub fn map_curve(curve: &impl Curve, values: &mut [f64]) {
    run_fused(MapTask { curve, values });
}

/// Replaces all values by `e^-x`; none may be negative.
pub fn map_decay(values: &mut [f64]) {
    struct Decay;
    impl Curve for Decay {
        #[inline(always)]
        fn at(&self, x: f64) -> f64 {
            decay(x)
        }
    }
    map_curve(&Decay, values);
}

/// Sines and cosines of `factor x`, all columns of one length. What becomes of a sample does not depend on the samples beside it.
///
/// # Panics
/// If the columns differ in length.
pub fn sin_cos_columns(factor: f64, angles: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
    assert!(angles.len() == sines.len() && angles.len() == cosines.len(), "columns of one length");
    run_on_lanes(SineTask { factor, angles, sines, cosines });
}

struct SineTask<'a> {
    factor: f64,
    angles: &'a [f64],
    sines: &'a mut [f64],
    cosines: &'a mut [f64],
}

impl LaneTask for SineTask<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let SineTask { factor, angles, sines, cosines } = self;
        let factor = S::from_f64(factor);
        let whole = angles.len() - angles.len() % LANES;
        for k in (0..whole).step_by(LANES) {
            let (sine, cosine) = (factor * load(&angles[k..])).sin_cos();
            store(sine, &mut sines[k..]);
            store(cosine, &mut cosines[k..]);
        }
        // The last ones go through lanes too: alone they would round otherwise.
        let rest = angles.len() - whole;
        let [mut last, mut sine, mut cosine] = [[0.0; LANES]; 3];
        last[..rest].copy_from_slice(&angles[whole..]);
        let (s, c) = (factor * load(&last)).sin_cos();
        store(s, &mut sine);
        store(c, &mut cosine);
        sines[whole..].copy_from_slice(&sine[..rest]);
        cosines[whole..].copy_from_slice(&cosine[..rest]);
    }
}

struct MapTask<'a, C> {
    curve: &'a C,
    values: &'a mut [f64],
}

impl<C: Curve> MapTask<'_, C> {
    #[inline(always)]
    fn run(self) {
        for x in self.values {
            *x = self.curve.at(*x);
        }
    }
}

impl<C: Curve> FusedTask for MapTask<'_, C> {
    #[inline(always)]
    fn fused(self) {
        self.run();
    }
    #[inline(always)]
    fn plain(self) {
        self.run();
    }
}

#[cfg(test)]
mod tests {
    use super::sin_cos_columns;

    #[test]
    fn sines_and_cosines_do_not_depend_on_the_place_in_a_column() {
        let angles: Vec<f64> = (0..103).map(|k| 0.37 * f64::from(k) - 17.0).chain([3e5, f64::NAN]).collect();
        let of = |angles: &[f64]| {
            let (mut sines, mut cosines) = (vec![0.0; angles.len()], vec![0.0; angles.len()]);
            sin_cos_columns(50.3, angles, &mut sines, &mut cosines);
            (sines, cosines)
        };
        let whole = of(&angles);
        for first in 0..angles.len() {
            let part = of(&angles[first..]);
            for k in 0..part.0.len() {
                let (sine, cosine) = (50.3 * angles[first + k]).sin_cos();
                let close = |found: f64, expected: f64| match expected.is_nan() {
                    true => found.is_nan(),
                    false => (found - expected).abs() < 1e-15,
                };
                assert!(close(part.0[k], sine) && close(part.1[k], cosine), "{}", angles[first + k]);
                assert_eq!(part.0[k].to_bits(), whole.0[first + k].to_bits());
                assert_eq!(part.1[k].to_bits(), whole.1[first + k].to_bits());
            }
        }
    }
}
