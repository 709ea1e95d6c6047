//! Prediction errors and their covariance.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::{SquareRoot, dot};

/// Errors of the prediction before a sample is used, and what is to be expected of them.
///
/// `e = y - Φ x`, `Σ_e = Σ_row + Φ P Φᵀ` with `P = (RᵀR)⁻¹`, `u = chol(Σ_e)⁻¹ e`, which is `N(0, 1)` while the model holds.
/// Rows come whitened, that is multiplied by `chol(Σ_row)⁻¹`, so that `Σ_e = 1 + GᵀG` with `G = R⁻ᵀ Φᵀ`; `u` is the same.
///
/// `Σ_row` should contain the noise of a measured regressor, `xᵀ Σ_φ x`, also where it is common to rows: without it
/// the rate of false alarms is off by orders of magnitude.
#[derive(Debug, Clone)]
pub struct Innovation {
    columns: usize,
    rows: usize,
    gain: Vec<f64>,
    factor: Vec<f64>,
    error: Vec<f64>,
    whitened: Vec<f64>,
}

impl Innovation {
    /// Workspace for `columns` parameters and up to `rows` rows.
    pub fn new(columns: usize, rows: usize) -> Self {
        Self {
            columns,
            rows: 0,
            gain: vec![0.0; columns * rows],
            factor: vec![0.0; rows * rows],
            error: vec![0.0; rows],
            whitened: vec![0.0; rows],
        }
    }

    /// Evaluates whitened rows `[φ y]` of `p + 1` entries each at the estimate `x`; `root` must be regular.
    pub fn evaluate(&mut self, root: &SquareRoot, x: &[f64], rows: &[f64]) {
        let p = self.columns;
        self.rows = rows.len() / (p + 1);
        for (i, row) in rows.chunks_exact(p + 1).enumerate() {
            self.error[i] = row[p] - dot(&row[..p], x);
            self.gain[i * p..(i + 1) * p].copy_from_slice(&row[..p]);
        }
        for g in self.gain[..self.rows * p].chunks_exact_mut(p) {
            root.solve_transposed(g);
        }
        let m = self.rows;
        for i in 0..m {
            for k in 0..=i {
                let own = if i == k { 1.0 } else { 0.0 };
                self.factor[i * m + k] =
                    own + dot(&self.gain[i * p..(i + 1) * p], &self.gain[k * p..(k + 1) * p]);
            }
        }
        let definite = cholesky(&mut self.factor[..m * m], m).is_ok();
        debug_assert!(definite, "1 + GᵀG is positive definite");
        self.whitened[..m].copy_from_slice(&self.error[..m]);
        solve_lower(&self.factor[..m * m], m, &mut self.whitened[..m], 1);
    }

    /// Whitened innovations `u`, one per row.
    pub fn whitened(&self) -> &[f64] {
        &self.whitened[..self.rows]
    }

    /// Errors of the whitened rows, in units of the rows' noise.
    pub fn error(&self) -> &[f64] {
        &self.error[..self.rows]
    }

    /// Variance of the error of whitened row `row`, `1 + φ P φᵀ`.
    pub fn variance(&self, row: usize) -> f64 {
        self.factor[row * self.rows..][..=row].iter().map(|l| l * l).sum()
    }
}

/// Cholesky factor `L` in the lower triangle of a symmetric `m × m` matrix; the first row without a positive pivot on failure.
pub(crate) fn cholesky(a: &mut [f64], m: usize) -> Result<(), usize> {
    for j in 0..m {
        for i in j..m {
            let sum: f64 = (0..j).map(|k| a[i * m + k] * a[j * m + k]).sum();
            a[i * m + j] -= sum;
            if i == j {
                if a[j * m + j].is_nan() || a[j * m + j] <= 0.0 {
                    return Err(j);
                }
                a[j * m + j] = libm::sqrt(a[j * m + j]);
            } else {
                a[i * m + j] /= a[j * m + j];
            }
        }
    }
    Ok(())
}

/// `b ← L⁻¹ b` for `m` rows of `width` entries.
pub(crate) fn solve_lower(l: &[f64], m: usize, b: &mut [f64], width: usize) {
    for i in 0..m {
        let (before, own) = b.split_at_mut(i * width);
        let own = &mut own[..width];
        for (k, row) in before.chunks_exact(width).enumerate() {
            let factor = l[i * m + k];
            if factor != 0.0 {
                own.iter_mut().zip(row).for_each(|(b, r)| *b -= factor * r);
            }
        }
        own.iter_mut().for_each(|b| *b /= l[i * m + i]);
    }
}
