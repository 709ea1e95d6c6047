//! How old samples lose their weight.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::{SquareRoot, dot};

/// How old samples lose their weight: what is done once per sample, before its rows are added.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Forgetting {
    /// Nothing is forgotten: every estimate is the batch solution of all samples and the prior.
    None,
    /// Information times `λ` in `(0, 1]`; the memory is `1/(1 - λ)` samples.
    Constant {
        /// `λ`.
        lambda: f64,
    },
    /// [`error_driven_factor`] of the [`relative_error`] of the sample's efforts (Sun et al., Eq. 44).
    /// Published: `α = 0.05`, `β = -4.68`.
    ErrorDriven {
        /// `α` in `[0, 1)`: the most that one sample forgets.
        alpha: f64,
        /// `β ≤ 0`.
        beta: f64,
        /// Efforts below this count as this large, in their unit; positive.
        floor: f64,
    },
    /// [`error_driven_factor`] of `max(0, rms(u) - d)/d` with the whitened innovations `u` and the dead zone
    /// `d`: errors that noise explains forget nothing, whatever the size of the efforts.
    NoiseNormalised {
        /// `α` in `[0, 1)`.
        alpha: f64,
        /// `β ≤ 0`.
        beta: f64,
        /// Dead zone `d`, in standard deviations; positive, 3 is usual.
        dead_zone: f64,
    },
    /// Information times `λ` in the directions of the sample alone: what it does not excite is kept (Cao &
    /// Schwartz 2000).
    Directional {
        /// `λ` in `(0, 1]`.
        lambda: f64,
        /// Directions with `‖R φ‖` below this share of `‖φ‖` are dropped (rows in units of their deviations,
        /// parameters in units of their scales); 1e-6 is usual.
        tolerance: f64,
    },
    /// Parameters that wander: `P ← P + Q dt` with `Q = diag(rate²)`, the time update of the Kalman filter.
    Drift {
        /// Standard deviation gained per `√s`, per parameter, in its unit; not negative.
        rate: Vec<f64>,
        /// Time between samples, s.
        interval: f64,
    },
    /// The last samples alone, in steps of a block: between `samples - samples/blocks + 1` and `samples`
    /// count ([`crate::BlockWindow`]). The prior always counts.
    BlockWindow {
        /// Length of the window, samples; a multiple of `blocks`.
        samples: usize,
        /// Number of blocks; 20 is usual.
        blocks: usize,
    },
    /// The last samples alone, one by one, by downdating ([`crate::RowWindow`]). The prior always counts.
    RowWindow {
        /// Length of the window, samples; a multiple of `blocks`.
        samples: usize,
        /// Number of blocks of which it is refreshed; 20 is usual.
        blocks: usize,
    },
}

/// `λ = (1 - α) + α exp(β ε²)` (Sun et al., Eq. 44).
pub fn error_driven_factor(relative_error: f64, alpha: f64, beta: f64) -> f64 {
    (1.0 - alpha) + alpha * libm::exp(beta * relative_error * relative_error)
}

/// `ε`: root mean square over rows of `|e|/max(|y|, floor)`, with the errors `e` of the prediction before the
/// sample is used.
///
/// The published rule leaves `ε` open; this is our choice.
pub fn relative_error(errors: &[f64], efforts: &[f64], floor: f64) -> f64 {
    let sum: f64 = errors.iter().zip(efforts).map(|(e, y)| e / y.abs().max(floor)).map(|r| r * r).sum();
    libm::sqrt(sum / errors.len().max(1) as f64)
}

/// Relative error of [`Forgetting::NoiseNormalised`]: `max(0, rms(u) - d)/d`.
pub fn excess_error(whitened: &[f64], dead_zone: f64) -> f64 {
    let square: f64 = whitened.iter().map(|u| u * u).sum();
    (libm::sqrt(square / whitened.len().max(1) as f64) - dead_zone).max(0.0) / dead_zone
}

/// Forgetting along the rows of a sample: `[R z] ← (1 - (1 - √λ) V Vᵀ) [R z]` with `V` an orthonormal basis
/// of `R Φᵀ`.
///
/// Information falls by `(1 - λ) Rᵀ V Vᵀ R`, the estimate stays. Done by rotations that keep `R` triangular.
/// `ρ²` and `N` lose the share `λ` whole.
///
/// Source: Cao & Schwartz 2000, for several rows.
#[derive(Debug, Clone)]
pub struct DirectionalForgetting {
    directions: Vec<f64>,
    share: Vec<f64>,
    discarded: Vec<f64>,
}

impl DirectionalForgetting {
    /// Workspace for `columns` parameters and up to `rows` rows.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self {
            directions: vec![0.0; columns * rows],
            share: vec![0.0; columns],
            discarded: vec![0.0; columns + 1],
        }
    }

    /// Forgets along `rows` (weighted, `[φ y]` of `p + 1` entries each).
    pub fn forget(&mut self, root: &mut SquareRoot, rows: &[f64], lambda: f64, tolerance: f64) {
        let p = root.columns();
        let mut found = 0;
        for row in rows.chunks_exact(p + 1) {
            let phi = &row[..p];
            let (basis, rest) = self.directions.split_at_mut(found * p);
            let direction = &mut rest[..p];
            root.times(phi, direction);
            let (size, whole) = (norm(direction), norm(phi));
            if size <= tolerance * whole || whole == 0.0 {
                continue;
            }
            found += usize::from(orthonormalise(direction, basis, tolerance));
        }
        let forgotten = libm::sqrt(1.0 - lambda);
        for k in 0..found {
            let (own, later) = self.directions[k * p..found * p].split_at_mut(p);
            for (a, v) in self.share.iter_mut().zip(own.iter()) {
                *a = forgotten * v;
            }
            root.deflate(&self.share, libm::sqrt(lambda), &mut self.discarded, later);
        }
        root.discount_remainder(lambda);
    }
}

/// Orthonormalises `v` against an orthonormal `basis`; false if less than `tolerance` of it is left.
pub(crate) fn orthonormalise(v: &mut [f64], basis: &[f64], tolerance: f64) -> bool {
    let size = norm(v);
    // Twice is enough (Kahan): the second pass removes what rounding left of the first.
    for _ in 0..2 {
        for b in basis.chunks_exact(v.len()) {
            let along = dot(v, b);
            v.iter_mut().zip(b).for_each(|(v, b)| *v -= along * b);
        }
    }
    let left = norm(v);
    if left <= tolerance * size {
        return false;
    }
    v.iter_mut().for_each(|v| *v /= left);
    true
}

/// `‖v‖` without overflow of the squares.
fn norm(v: &[f64]) -> f64 {
    let largest = v.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    largest * libm::sqrt(v.iter().map(|v| (v / largest) * (v / largest)).sum())
}

/// Share of its floor that a parameter may lose before it is put back.
const RIPPLE: f64 = 0.05;

/// Floor under the information: where nothing comes in, each parameter keeps about the information `δ_j`.
///
/// A parameter that has been discounted to `c < 0.95` in all since its last turn gets the row
/// `√(1.025 δ_j (1 - c)) e_j` with target `x_j`, so that the floor ripples by 2.5 % either way, or by what a
/// single sample forgets. Turns are staggered. The estimate stays.
#[derive(Debug, Clone)]
pub struct BoundedCovariance {
    floor: Vec<f64>,
    left: Vec<f64>,
    row: Vec<f64>,
}

impl BoundedCovariance {
    /// `floor`: least information `δ_j` per parameter, in inverse squares of its unit.
    pub fn new(floor: &[f64]) -> Self {
        let p = floor.len();
        let left = (0..p).map(|j| 1.0 - RIPPLE * j as f64 / p as f64).collect();
        Self { floor: floor.to_vec(), left, row: vec![0.0; p + 1] }
    }

    /// Puts back what a discount by `lambda` takes from the floor; `x` is the estimate.
    pub fn hold(&mut self, root: &mut SquareRoot, x: &[f64], lambda: f64) {
        let p = root.columns();
        for (j, x) in x.iter().enumerate().take(p) {
            self.left[j] *= lambda;
            if self.left[j] > 1.0 - RIPPLE {
                continue;
            }
            let size = libm::sqrt((1.0 + 0.5 * RIPPLE) * self.floor[j] * (1.0 - self.left[j]));
            self.left[j] = 1.0;
            self.row.fill(0.0);
            self.row[j] = size;
            self.row[p] = size * x;
            root.push_pseudo(j, &mut self.row);
        }
    }

    pub(crate) fn transfer(&mut self, transfer: &mut dynid_words::Transfer<'_>) {
        transfer.finites(&mut self.left);
    }
}
