//! Prediction errors and their covariance.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::{SquareRoot, dot};

/// Whitened innovations are cut off here, so that their squares stay finite.
const LARGEST: f64 = 1e100;

/// Errors of the prediction before a sample is used, and what is to be expected of them.
///
/// `e = y - Φ x`, `Σ_e = Σ_row + Φ P Φᵀ` with `P = (RᵀR)⁻¹`, `u = chol(Σ_e)⁻¹ e`, which is `N(0, 1)` while
/// the model holds. Rows come whitened, that is multiplied by `chol(Σ_row)⁻¹`, so that `Σ_e = 1 + GᵀG` with
/// `G = R⁻ᵀ Φᵀ`; `u` is the same.
///
/// `Σ_row` should contain the noise of a measured regressor, `xᵀ Σ_φ x`, also where it is common to rows:
/// without it the rate of false alarms is off by orders of magnitude.
#[derive(Debug, Clone)]
pub struct Innovation {
    columns: usize,
    rows: usize,
    /// Columns of `[G; 1]`, one after the other, orthonormalised in place.
    gain: Vec<f64>,
    /// `T` with `TᵀT = Σ_e` of whitened rows, row by row.
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
            gain: vec![0.0; (columns + rows) * rows],
            factor: vec![0.0; rows * rows],
            error: vec![0.0; rows],
            whitened: vec![0.0; rows],
        }
    }

    /// Evaluates whitened rows `[φ y]` of `p + 1` entries each at the estimate `x`; `root` must be regular.
    pub fn evaluate(&mut self, root: &SquareRoot, x: &[f64], rows: &[f64]) {
        let p = self.columns;
        let m = rows.len() / (p + 1);
        let length = p + m;
        self.rows = m;
        for (i, row) in rows.chunks_exact(p + 1).enumerate() {
            self.error[i] = row[p] - dot(&row[..p], x);
            let column = &mut self.gain[i * length..(i + 1) * length];
            column[..p].copy_from_slice(&row[..p]);
            root.solve_transposed(&mut column[..p]);
            column[p..].fill(0.0);
            column[p + i] = 1.0;
        }
        self.whitened[..m].copy_from_slice(&self.error[..m]);
        // Gram-Schmidt on [G; 1] instead of Cholesky on 1 + GᵀG: entry i of the lower part of column i stays
        // 1, so no pivot falls below 1 however large and parallel the gains.
        for i in 0..m {
            let (done, later) = self.gain[i * length..m * length].split_at_mut(length);
            let size = libm::sqrt(dot(done, done));
            done.iter_mut().for_each(|q| *q /= size);
            self.factor[i * m + i] = size;
            self.whitened[i] = (self.whitened[i] / size).clamp(-LARGEST, LARGEST);
            for (k, column) in (i + 1..m).zip(later.chunks_exact_mut(length)) {
                let along = dot(done, column);
                column.iter_mut().zip(done.iter()).for_each(|(g, q)| *g -= along * q);
                self.factor[i * m + k] = along;
                self.whitened[k] -= along * self.whitened[i];
            }
        }
    }

    /// Whitened innovations `u`, one per row, within ±1e100.
    pub fn whitened(&self) -> &[f64] {
        &self.whitened[..self.rows]
    }

    /// Errors of the whitened rows, in units of the rows' noise.
    pub fn error(&self) -> &[f64] {
        &self.error[..self.rows]
    }

    /// Variance of the error of whitened row `row`, `1 + φ P φᵀ`.
    pub fn variance(&self, row: usize) -> f64 {
        (0..=row).map(|k| self.factor[k * self.rows + row]).map(|t| t * t).sum()
    }
}

impl Innovation {
    /// Largest leverage of the rows against what is known, `φ P φᵀ` over the variance of the row's noise: how much of the error comes from
    /// what the samples before have not told.
    pub fn leverage(&self) -> f64 {
        (0..self.rows).map(|row| self.variance(row) - 1.0).fold(0.0, f64::max)
    }
}

/// Cholesky factor `L` in the lower triangle of a symmetric `m × m` matrix; the first row without a positive
/// pivot on failure.
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
