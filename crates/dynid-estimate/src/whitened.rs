//! Time blocks in the coordinates in which the whole problem is orthonormal.
//!
//! With `R` of the merged blocks, `Q_b = R_b R⁻¹` satisfy `Σ Q_bᵀQ_b = 1`. Sums of `Q_bᵀQ_b` over other sets of blocks are
//! then conditioned as the statistics of the log are, not as its parameters: forming them loses no digits that matter,
//! where the same sums of `R_bᵀR_b` would lose twice those of the condition number.

use dynid_factor::factor::Factor;
use dynid_factor::rank::numerical_rank;
use dynid_linalg::triangular::{inverse, symmetric_from};
use dynid_linalg::{Cholesky, Mat};

/// Least squared pivot at which a set of blocks still counts as exciting every direction.
const LEAST_PIVOT: f64 = 1e-10;

/// Weight of the ridge that stands in for directions a set of blocks does not excite.
const FALLBACK_RIDGE: f64 = 1e-8;

/// One time block: `q = R_b R⁻¹`, and its effort `z`, `ρ`.
#[derive(Debug, Clone)]
pub(crate) struct WhitenedBlock {
    pub(crate) q: Mat,
    pub(crate) z: Vec<f64>,
    pub(crate) rho: f64,
    pub(crate) rows: usize,
}

impl WhitenedBlock {
    fn new(factor: &Factor, inverse: &Mat) -> Self {
        let height = factor.height();
        let triangle = Mat::from_fn(height, factor.columns(), |i, j| factor.r(i, j));
        let mut z = factor.z();
        z.truncate(height);
        WhitenedBlock { q: triangle * inverse, z, rho: factor.rho(), rows: factor.rows() }
    }

    /// `z - q d`.
    pub(crate) fn residual(&self, d: &[f64]) -> Vec<f64> {
        let mut out = self.z.clone();
        for (j, value) in d.iter().enumerate() {
            for (r, q) in out.iter_mut().zip(self.q.col(j).iter()) {
                *r -= q * value;
            }
        }
        out
    }

    /// `qᵀ v`.
    pub(crate) fn transposed(&self, v: &[f64]) -> Vec<f64> {
        (0..self.q.ncols()).map(|j| self.q.col(j).iter().zip(v).map(|(q, v)| q * v).sum()).collect()
    }

    /// `qᵀ q`.
    pub(crate) fn gram(&self) -> Mat {
        self.q.transpose() * &self.q
    }
}

/// Blocks, rows outside all blocks, and `R⁻¹` of all of them; `None` if the columns are dependent or there is no block.
pub(crate) struct Whitened {
    pub(crate) merged: Factor,
    pub(crate) inverse: Mat,
    pub(crate) blocks: Vec<WhitenedBlock>,
    pub(crate) fixed: Option<WhitenedBlock>,
}

impl Whitened {
    pub(crate) fn new(blocks: &[Factor], fixed: Option<&Factor>) -> Option<Self> {
        if blocks.is_empty() {
            return None;
        }
        let merged = Factor::merge(&blocks.iter().chain(fixed).collect::<Vec<_>>());
        if numerical_rank(&merged).rank < merged.columns() {
            return None;
        }
        let inverse = inverse(&merged.r_matrix());
        let blocks = blocks.iter().map(|b| WhitenedBlock::new(b, &inverse)).collect();
        let fixed = fixed.map(|f| WhitenedBlock::new(f, &inverse));
        Some(Whitened { merged, inverse, blocks, fixed })
    }
}

/// Cholesky factor of a sum of Gram matrices, and whether it took a ridge.
pub(crate) fn cholesky(gram: &Mat) -> Option<(Cholesky, bool)> {
    if let Some(factor) = gram.cholesky() {
        let l = factor.lower();
        if (0..gram.nrows()).all(|i| l[(i, i)] * l[(i, i)] > LEAST_PIVOT) {
            return Some((factor, false));
        }
    }
    let ridged =
        symmetric_from(gram.nrows(), |i, j| gram[(i, j)] + if i == j { FALLBACK_RIDGE } else { 0.0 });
    ridged.cholesky().map(|factor| (factor, true))
}

/// `U v` with `U` upper triangular.
pub(crate) fn upper_times(u: &Mat, v: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; v.len()];
    for (j, value) in v.iter().enumerate() {
        for (o, u) in out.iter_mut().zip(u.col(j).iter()).take(j + 1) {
            *o += u * value;
        }
    }
    out
}
