//! Streaming QR in double-double arithmetic, row by row.

use super::builder::{block_rows, require_finite};
use super::{DoubleDouble, Factor, FactorError};
use faer::Mat;
use std::ops::Range;

/// Rows staged between the caller's columns and the rotations.
const STAGED_ROWS: usize = 64;

/// Triangular factor `(R, z, ρ, N)` kept in double-double arithmetic; see [`Factor`] for the terms.
///
/// Row `i` of the triangle is either zero throughout or starts with a positive entry in column `i`.
#[derive(Debug, Clone, PartialEq)]
pub struct ExtendedFactor {
    /// `[[R, z], [0, ρ]]` by rows, `(columns + 1)²` entries, zeros below the diagonal.
    triangle: Vec<DoubleDouble>,
    columns: usize,
    rows: usize,
}

impl ExtendedFactor {
    /// Factor of no rows, with `columns` parameters.
    pub fn empty(columns: usize) -> Self {
        let width = columns + 1;
        Self { triangle: vec![DoubleDouble::ZERO; width * width], columns, rows: 0 }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number `N` of rows consumed.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Entry `R[row, column]`. Panics outside `p × p`.
    pub fn r(&self, row: usize, column: usize) -> DoubleDouble {
        assert!(row < self.columns && column < self.columns, "R is p × p");
        self.row(row)[column]
    }

    /// Entry `z[row]`, in the unit of effort. Panics unless `row` is below `p`.
    pub fn z(&self, row: usize) -> DoubleDouble {
        assert!(row < self.columns, "z has p entries");
        self.row(row)[self.columns]
    }

    /// `ρ ≥ 0`, in the unit of effort; the least residual norm when `R` has full rank.
    pub fn rho(&self) -> DoubleDouble {
        self.row(self.columns)[self.columns]
    }

    /// The factor in double precision, every entry rounded once.
    pub fn rounded(&self) -> Factor {
        let kept: Vec<usize> = (0..self.columns).filter(|&i| self.r(i, i) != DoubleDouble::ZERO).collect();
        Factor {
            triangle: Mat::from_fn(kept.len(), self.columns + 1, |i, j| self.row(kept[i])[j].to_f64()),
            rho: self.rho().to_f64(),
            columns: self.columns,
            rows: self.rows,
        }
    }

    /// Merges factors of disjoint rows with the same columns, always in the order given.
    ///
    /// Equals the factor of all rows stacked, up to rounding in double-double. Panics on an empty list or unequal
    /// columns.
    pub fn merge(factors: &[&ExtendedFactor]) -> ExtendedFactor {
        assert!(!factors.is_empty(), "nothing to merge");
        let mut builder = ExtendedBuilder::new(factors[0].columns);
        for factor in factors {
            builder.push_factor(factor);
        }
        builder.finish()
    }

    /// Factor of the chosen columns of `W` in the order given (same rows, same effort).
    ///
    /// Panics if an index is not below `p`.
    pub fn select(&self, columns: &[usize]) -> ExtendedFactor {
        assert!(columns.iter().all(|&c| c < self.columns), "selected columns exist");
        let mut selected = ExtendedFactor::empty(columns.len());
        let mut row = Vec::with_capacity(columns.len() + 1);
        for i in 0..=self.columns {
            row.clear();
            row.extend(columns.iter().chain([&self.columns]).map(|&c| self.row(i)[c]));
            selected.rotate_in(&mut row);
        }
        selected.rows = self.rows;
        selected
    }

    fn row(&self, i: usize) -> &[DoubleDouble] {
        let width = self.columns + 1;
        &self.triangle[i * width..(i + 1) * width]
    }

    /// Rotates one row of `[W y]` into the triangle; leaves zeros in `row`.
    fn rotate_in(&mut self, row: &mut [DoubleDouble]) {
        let width = self.columns + 1;
        for (j, held) in self.triangle.chunks_exact_mut(width).enumerate() {
            if row[j] != DoubleDouble::ZERO {
                let (cosine, sine) = givens(held[j], row[j]);
                for (above, below) in held[j..].iter_mut().zip(&mut row[j..]) {
                    (*above, *below) = (cosine * *above + sine * *below, cosine * *below - sine * *above);
                }
                row[j] = DoubleDouble::ZERO;
            }
        }
    }
}

/// `(c, s)` with `c a + s b = √(a² + b²) > 0` and `c b - s a = 0`, without overflow of the squares; `b ≠ 0`.
///
/// Source: Golub & Van Loan, *Matrix Computations*, 5.1.8.
fn givens(a: DoubleDouble, b: DoubleDouble) -> (DoubleDouble, DoubleDouble) {
    let of_larger = |ratio: DoubleDouble, larger: DoubleDouble| {
        let cosine = DoubleDouble::ONE / (DoubleDouble::ONE + ratio * ratio).sqrt();
        if larger < DoubleDouble::ZERO { -cosine } else { cosine }
    };
    if a.abs() >= b.abs() {
        let ratio = b / a;
        let cosine = of_larger(ratio, a);
        (cosine, ratio * cosine)
    } else {
        let ratio = a / b;
        let sine = of_larger(ratio, b);
        (ratio * sine, sine)
    }
}

/// Reduces rows of `[W y]` to an [`ExtendedFactor`]: the reduction of [`super::FactorBuilder`] with 32 digits.
///
/// Each row is rotated into the triangle as it comes, in `(p + 1)²` double-doubles of memory, so that the result
/// depends on the rows and their order only.
///
/// A reduction in double precision behaves as if every effort had been rounded at `ε ‖y‖`, and every column at `ε`
/// of its norm. Least squares amplifies both by the scaled condition number `κ`: parameters lose digits once
/// `κ ε ‖y‖` shows beside `‖W_c x_c‖`. Extended precision pays for small problems where that happens although the
/// rows are known better than `κ ε`: polynomials, residuals far larger than what a column explains, reference
/// values. It does not help against noise, and takes 40 to 70 times as long as `FactorBuilder` at 8 columns, 130 to
/// 250 times at 64 (2000 rows, target without fused multiply-add; `cargo bench -p dynid-estimate`).
///
/// Solve it as it is; rounding the factor first gives back most of what was gained.
#[derive(Debug, Clone)]
pub struct ExtendedBuilder {
    factor: ExtendedFactor,
    /// Portion of rows by columns, as the caller writes them.
    staged: Vec<f64>,
    row: Vec<DoubleDouble>,
}

impl ExtendedBuilder {
    /// Builder for `columns` parameters.
    pub fn new(columns: usize) -> Self {
        Self {
            factor: ExtendedFactor::empty(columns),
            staged: vec![0.0; (columns + 1) * STAGED_ROWS],
            row: vec![DoubleDouble::ZERO; columns + 1],
        }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.factor.columns
    }

    /// Rows accepted since the builder was made or last emptied by [`Self::take`].
    pub fn rows(&self) -> usize {
        self.factor.rows
    }

    /// Appends the rows of a column-major block; as [`super::FactorBuilder::push_block`].
    pub fn push_block(
        &mut self,
        regressor: &[f64],
        stride: usize,
        effort: &[f64],
    ) -> Result<(), FactorError> {
        let fill = block_rows(self.columns(), regressor, stride, effort)?;
        self.push_with(effort.len(), fill)
    }

    /// Appends one row: `regressor` with `p` entries, and its effort.
    pub fn push_row(&mut self, regressor: &[f64], effort: f64) -> Result<(), FactorError> {
        self.push_block(regressor, 1, std::slice::from_ref(&effort))
    }

    /// Appends one row whose entries are known beyond double precision, for instance powers of a measured number.
    ///
    /// Fails if `regressor` does not have `p` entries or a value is not finite.
    pub fn push_extended_row(
        &mut self,
        regressor: &[DoubleDouble],
        effort: DoubleDouble,
    ) -> Result<(), FactorError> {
        let columns = self.columns();
        if regressor.len() != columns {
            return Err(FactorError::BlockShape {
                columns,
                rows: 1,
                stride: 1,
                expected: columns,
                found: regressor.len(),
            });
        }
        let entries = || regressor.iter().copied().chain([effort]);
        if let Some((column, found)) = entries().enumerate().find(|(_, v)| !v.is_finite()) {
            return Err(FactorError::NotFinite {
                row: self.factor.rows,
                column: (column < columns).then_some(column),
                found: found.to_f64(),
            });
        }
        self.row.iter_mut().zip(entries()).for_each(|(slot, value)| *slot = value);
        self.factor.rotate_in(&mut self.row);
        self.factor.rows += 1;
        Ok(())
    }

    /// Appends `rows` rows that `fill` writes column by column; as [`super::FactorBuilder::push_with`].
    pub fn push_with(
        &mut self,
        rows: usize,
        mut fill: impl FnMut(usize, Range<usize>, &mut [f64]),
    ) -> Result<(), FactorError> {
        let columns = self.columns();
        let mut start = 0;
        while start < rows {
            let taken = (rows - start).min(STAGED_ROWS);
            for (column, out) in self.staged.chunks_exact_mut(STAGED_ROWS).enumerate() {
                fill(column, start..start + taken, &mut out[..taken]);
                require_finite(&out[..taken], self.factor.rows, (column < columns).then_some(column))?;
            }
            for i in 0..taken {
                for (slot, column) in self.row.iter_mut().zip(self.staged.chunks_exact(STAGED_ROWS)) {
                    *slot = column[i].into();
                }
                self.factor.rotate_in(&mut self.row);
            }
            self.factor.rows += taken;
            start += taken;
        }
        Ok(())
    }

    /// Merges a factor: its triangle is rotated in like rows, its row count added. Panics on unequal columns.
    pub fn push_factor(&mut self, factor: &ExtendedFactor) {
        assert_eq!(factor.columns, self.columns(), "factors to merge need the same columns");
        for i in 0..=factor.columns {
            self.row.copy_from_slice(factor.row(i));
            self.factor.rotate_in(&mut self.row);
        }
        self.factor.rows += factor.rows;
    }

    /// The factor of all rows so far; empties the builder.
    pub fn take(&mut self) -> ExtendedFactor {
        let empty = ExtendedFactor::empty(self.columns());
        std::mem::replace(&mut self.factor, empty)
    }

    /// The factor of all rows.
    pub fn finish(self) -> ExtendedFactor {
        self.factor
    }
}
