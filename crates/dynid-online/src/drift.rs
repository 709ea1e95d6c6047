//! Parameters that wander.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::SquareRoot;

/// Time update `P ← P + diag(q)` in square-root form; no covariance is formed.
///
/// QR of `[[Q^{-1/2}, 0, 0], [-R, R, z]]` one column of process noise at a time, so that `R` stays
/// triangular: `2 p³` operations if every parameter wanders, `6 p²` at most for each that does. The estimate
/// stays.
///
/// Source: Bierman 1977, chapter 6.
#[derive(Debug, Clone)]
pub struct Drift {
    variance: Vec<f64>,
    scratch: Vec<f64>,
}

impl Drift {
    /// `variance`: what a step adds to each parameter's variance, in squares of its unit.
    pub fn new(variance: &[f64]) -> Self {
        Self { variance: variance.to_vec(), scratch: vec![0.0; 2 * variance.len() + 1] }
    }

    /// One step; parameters that are `frozen` do not wander.
    pub fn advance(&mut self, root: &mut SquareRoot, frozen: &[bool]) {
        for (j, (variance, frozen)) in self.variance.iter().zip(frozen).enumerate() {
            if !frozen {
                root.open(j, *variance, &mut self.scratch);
            }
        }
    }
}
