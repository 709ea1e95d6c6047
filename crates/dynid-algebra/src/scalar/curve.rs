//! Functions of one number over columns, in wide registers where the processor has them.

use super::dispatch::{FusedTask, run_fused};
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
