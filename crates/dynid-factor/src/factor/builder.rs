//! Streaming QR: rows in, one triangle out, in fixed memory.

use super::Factor;
use dynid_linalg::{Mat, QrRoom};
use std::ops::Range;

/// Rows stacked under the current triangle before it is renewed, unless chosen otherwise.
pub const DEFAULT_CHUNK_ROWS: usize = 2048;

/// Rows that a [`FactorBuilder`] cannot take.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FactorError {
    /// A value is NaN or infinite.
    #[error("row {row}, {}: expected a finite number, found {found}", column_name(*column))]
    NotFinite {
        /// Row, counted from 0 over all rows this builder has accepted since it was last emptied.
        row: usize,
        /// Column of the regressor, `None` for the effort.
        column: Option<usize>,
        /// The value found.
        found: f64,
    },
    /// The slice of regressor values does not fit the stated shape.
    #[error(
        "regressor block of {columns} columns and {rows} rows at stride {stride}: expected {expected} values, found {found}"
    )]
    BlockShape {
        /// Columns of the factor.
        columns: usize,
        /// Rows of the block.
        rows: usize,
        /// Distance between the starts of two columns.
        stride: usize,
        /// Least number of values needed.
        expected: usize,
        /// Number of values given.
        found: usize,
    },
}

fn column_name(column: Option<usize>) -> String {
    column.map_or_else(|| "effort".to_owned(), |c| format!("regressor column {c}"))
}

/// Reduces rows of `[W y]` to a [`Factor`] with one reused buffer of `(p + 1 + chunk) × (p + 1)` numbers.
///
/// Pending rows are stacked under the current triangle; when the chunk is full, a Householder QR renews the
/// triangle. The result depends on the rows, their order and the chunk length, but not on how the rows were
/// portioned into calls. Backward stable column by column, so column scaling is neither needed nor done here.
pub struct FactorBuilder {
    columns: usize,
    buffer: Mat,
    room: QrRoom,
    /// Rows of the buffer taken by the current triangle.
    head: usize,
    /// Rows of the buffer in use, triangle included.
    filled: usize,
    rows: usize,
    /// `ρ` of merged factors, which needs no rotation.
    rho: f64,
}

impl std::fmt::Debug for FactorBuilder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("FactorBuilder")
            .field("columns", &self.columns)
            .field("rows", &self.rows)
            .field("pending", &(self.filled - self.head))
            .finish_non_exhaustive()
    }
}

impl FactorBuilder {
    /// Builder for `columns` parameters with chunks of [`DEFAULT_CHUNK_ROWS`].
    pub fn new(columns: usize) -> Self {
        Self::with_chunk_rows(columns, DEFAULT_CHUNK_ROWS)
    }

    /// Builder for `columns` parameters that renews the triangle every `chunk_rows` rows (at least 1).
    pub fn with_chunk_rows(columns: usize, chunk_rows: usize) -> Self {
        let width = columns + 1;
        let capacity = width + chunk_rows.max(1);
        Self {
            columns,
            buffer: Mat::zeros(capacity, width),
            room: QrRoom::new(capacity, width),
            head: 0,
            filled: 0,
            rows: 0,
            rho: 0.0,
        }
    }

    /// Number `p` of parameters.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Rows accepted since the builder was made or last emptied by [`Self::take`].
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Appends the rows of a column-major block.
    ///
    /// `regressor[c * stride + i]` is column `c` of row `i`; `effort[i]` its effort, and `effort.len()` the number
    /// of rows. Fails if `regressor` is too short or a value is not finite; rows before the first offending
    /// chunk stay consumed, so drop the builder or [`Self::take`] after a failure.
    pub fn push_block(
        &mut self,
        regressor: &[f64],
        stride: usize,
        effort: &[f64],
    ) -> Result<(), FactorError> {
        let fill = block_rows(self.columns, regressor, stride, effort)?;
        self.push_with(effort.len(), fill)
    }

    /// Appends one row: `regressor` with `p` entries, and its effort.
    pub fn push_row(&mut self, regressor: &[f64], effort: f64) -> Result<(), FactorError> {
        self.push_block(regressor, 1, std::slice::from_ref(&effort))
    }

    /// Appends `rows` rows that `fill` writes straight into the buffer.
    ///
    /// `fill(column, range, out)` must write rows `range` (counted within this call) of column `column` to `out`;
    /// columns `0..p` are the regressor, column `p` the effort. Called for each column of each portion in turn.
    pub fn push_with(
        &mut self,
        rows: usize,
        mut fill: impl FnMut(usize, Range<usize>, &mut [f64]),
    ) -> Result<(), FactorError> {
        let mut start = 0;
        while start < rows {
            if self.filled == self.buffer.nrows() {
                self.condense();
            }
            let taken = (rows - start).min(self.buffer.nrows() - self.filled);
            for column in 0..=self.columns {
                let out = &mut self.buffer.col_mut(column)[self.filled..self.filled + taken];
                fill(column, start..start + taken, out);
                require_finite(out, self.rows, (column < self.columns).then_some(column))?;
            }
            self.filled += taken;
            self.rows += taken;
            start += taken;
        }
        Ok(())
    }

    /// Merges a factor: its triangle is stacked like rows, its row count added. Panics on unequal columns.
    pub fn push_factor(&mut self, factor: &Factor) {
        assert_eq!(factor.columns(), self.columns, "factors to merge need the same columns");
        let triangle = factor.triangle();
        self.stack(triangle.nrows(), |i, j| triangle[(i, j)]);
        self.rho = self.rho.hypot(factor.rho());
        self.rows += factor.rows();
    }

    /// Stacks rows that are combinations of rows counted elsewhere.
    pub(super) fn stack(&mut self, rows: usize, entry: impl Fn(usize, usize) -> f64) {
        for i in 0..rows {
            if self.filled == self.buffer.nrows() {
                self.condense();
            }
            for j in 0..=self.columns {
                self.buffer[(self.filled, j)] = entry(i, j);
            }
            self.filled += 1;
        }
    }

    /// The factor of all rows so far; empties the builder and keeps its buffer.
    pub fn take(&mut self) -> Factor {
        if self.filled > self.head {
            self.condense();
        }
        let (triangle, remainder) = canonical(&self.buffer, self.head, self.columns);
        let factor =
            Factor { triangle, rho: self.rho.hypot(remainder), columns: self.columns, rows: self.rows };
        (self.head, self.filled, self.rows, self.rho) = (0, 0, 0, 0.0);
        factor
    }

    /// The factor of all rows.
    #[must_use]
    pub fn finish(mut self) -> Factor {
        self.take()
    }

    fn condense(&mut self) {
        let height = self.filled.min(self.columns + 1);
        self.room.reduce(&mut self.buffer, self.filled);
        for j in 0..=self.columns {
            let below = (j + 1).min(height);
            self.buffer.col_mut(j)[below..height].fill(0.0);
        }
        (self.head, self.filled) = (height, height);
    }
}

/// `[R z]` with positive leading entries, and the norm of what sits in `z` beside empty rows of `R`.
fn canonical(buffer: &Mat, height: usize, columns: usize) -> (Mat, f64) {
    let mut kept = Vec::with_capacity(height);
    let mut remainder = 0.0_f64;
    for i in 0..height {
        match (i..columns).map(|j| buffer[(i, j)]).find(|v| *v != 0.0) {
            Some(lead) => kept.push((i, lead.signum())),
            None => remainder = remainder.hypot(buffer[(i, columns)]),
        }
    }
    let triangle = Mat::from_fn(kept.len(), columns + 1, |k, j| {
        let (i, sign) = kept[k];
        if j < k { 0.0 } else { sign * buffer[(i, j)] }
    });
    (triangle, remainder)
}

/// Filler for `push_with` that copies a column-major block, checked for its shape.
fn block_rows<'a>(
    columns: usize,
    regressor: &'a [f64],
    stride: usize,
    effort: &'a [f64],
) -> Result<impl FnMut(usize, Range<usize>, &mut [f64]) + 'a, FactorError> {
    let rows = effort.len();
    let expected = if rows == 0 || columns == 0 { 0 } else { (columns - 1) * stride + rows };
    if regressor.len() < expected || (stride < rows && columns > 1) {
        return Err(FactorError::BlockShape {
            columns,
            rows,
            stride,
            expected: expected.max(columns * rows),
            found: regressor.len(),
        });
    }
    Ok(move |column: usize, range: Range<usize>, out: &mut [f64]| {
        if column < columns {
            let start = column * stride;
            out.copy_from_slice(&regressor[start + range.start..start + range.end]);
        } else {
            out.copy_from_slice(&effort[range]);
        }
    })
}

/// Fails if a value is not finite; `values` are those of `column` from row `first_row` on.
fn require_finite(values: &[f64], first_row: usize, column: Option<usize>) -> Result<(), FactorError> {
    match first_not_finite(values) {
        Some(offset) => {
            Err(FactorError::NotFinite { row: first_row + offset, column, found: values[offset] })
        }
        None => Ok(()),
    }
}

fn first_not_finite(values: &[f64]) -> Option<usize> {
    // A sum of v·0 is NaN exactly when some v is not finite; eight lanes keep it at memory speed.
    let mut lanes = [0.0_f64; 8];
    let chunks = values.chunks_exact(8);
    let rest = chunks.remainder().iter().map(|v| v * 0.0).sum::<f64>();
    for chunk in chunks {
        for (lane, value) in lanes.iter_mut().zip(chunk) {
            *lane += value * 0.0;
        }
    }
    let all_finite = lanes.iter().sum::<f64>() + rest == 0.0;
    if all_finite { None } else { values.iter().position(|v| !v.is_finite()) }
}
