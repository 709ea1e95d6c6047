//! From a sample to weighted rows.

use alloc::vec;
use alloc::vec::Vec;

use crate::error::SampleError;
use crate::innovation::{cholesky, solve_lower};

/// Entries of weighted rows beyond this are refused, since squares of gains could overflow.
const LARGEST: f64 = 1e75;
/// Noise of the rows of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RowNoise<'a> {
    /// Standard deviation of each row, in the unit of its effort; independent of each other.
    Std(&'a [f64]),
    /// Covariance of the rows, `m × m`, row by row; the lower triangle is read. Where regressors are
    /// measured, this is the place for `xᵀ Σ_φ x`, which rows may have in common.
    Covariance(&'a [f64]),
}

/// Whitened rows `[φ y]` of a sample, with parameters in scales.
#[derive(Debug, Clone)]
pub(crate) struct WeightedRows {
    scale: Vec<f64>,
    most: usize,
    count: usize,
    rows: Vec<f64>,
    noise: Vec<f64>,
}

impl WeightedRows {
    pub(crate) fn new(scale: &[f64], most: usize) -> Self {
        Self {
            scale: scale.to_vec(),
            most,
            count: 0,
            rows: vec![0.0; most * (scale.len() + 1)],
            noise: vec![0.0; most * most],
        }
    }

    /// Rows of the sample loaded last.
    pub(crate) fn get(&self) -> &[f64] {
        &self.rows[..self.count * (self.scale.len() + 1)]
    }

    /// The rows, for those who use them up.
    pub(crate) fn get_mut(&mut self) -> &mut [f64] {
        &mut self.rows[..self.count * (self.scale.len() + 1)]
    }

    /// Writes whitened rows `[φ y]` with parameters in scales; after an error they are of no use.
    pub(crate) fn load(
        &mut self,
        regressor: &[f64],
        effort: &[f64],
        noise: RowNoise<'_>,
    ) -> Result<(), SampleError> {
        let (p, m) = (self.scale.len(), effort.len());
        if m == 0 || m > self.most {
            return Err(SampleError::Rows { most: self.most, found: m });
        }
        let (what, list, expected) = match noise {
            RowNoise::Std(list) => ("row deviations", list, m),
            RowNoise::Covariance(list) => ("row covariance", list, m * m),
        };
        for (what, list, expected) in [("regressor", regressor, m * p), (what, list, expected)] {
            if list.len() != expected {
                return Err(SampleError::Length { what, expected, found: list.len() });
            }
        }
        for (what, list) in [("regressor", regressor), ("effort", effort), (what, list)] {
            if let Some(index) = list.iter().position(|v| !v.is_finite()) {
                return Err(SampleError::NotFinite { what, index });
            }
        }
        let rows = &mut self.rows[..m * (p + 1)];
        let given = regressor.chunks_exact(p).zip(effort);
        for (row, (phi, y)) in rows.chunks_exact_mut(p + 1).zip(given) {
            for (entry, (f, s)) in row.iter_mut().zip(phi.iter().zip(&self.scale)) {
                *entry = f * s;
            }
            row[p] = *y;
        }
        match noise {
            RowNoise::Std(list) => {
                for (i, (row, std)) in rows.chunks_exact_mut(p + 1).zip(list).enumerate() {
                    if *std <= 0.0 {
                        return Err(SampleError::Noise { row: i });
                    }
                    row.iter_mut().for_each(|v| *v /= std);
                }
            }
            RowNoise::Covariance(list) => {
                let factor = &mut self.noise[..m * m];
                factor.copy_from_slice(list);
                cholesky(factor, m).map_err(|row| SampleError::Noise { row })?;
                solve_lower(factor, m, rows, p + 1);
            }
        }
        match rows.iter().position(|v| v.is_nan() || v.abs() > LARGEST) {
            Some(place) if place % (p + 1) == p => {
                Err(SampleError::NotFinite { what: "effort", index: place / (p + 1) })
            }
            Some(place) => {
                let index = place / (p + 1) * p + place % (p + 1);
                Err(SampleError::NotFinite { what: "regressor", index })
            }
            None => {
                self.count = m;
                Ok(())
            }
        }
    }
}
