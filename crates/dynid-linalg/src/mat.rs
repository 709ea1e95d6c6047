//! The dense matrix.

use std::ops::{Index, IndexMut, Range};

use crate::{AsView, View};
use faer::linalg::matmul::matmul;
use faer::{Accum, ColRef, MatMut, MatRef, Par};

/// Dense matrix of doubles, column-major, indexed `m[(row, column)]`.
///
/// Products, sums and multiples are operators: `&a * &b`, `a.transpose() * &b`, `&a * 2.0`. Indices and sizes that do not agree
/// panic.
#[derive(PartialEq)]
pub struct Mat(pub(crate) faer::Mat<f64>);

// Not derived: a derived one is compiled with everyone who clones.
impl Clone for Mat {
    fn clone(&self) -> Mat {
        Mat(self.0.clone())
    }
}

impl AsView for Mat {
    fn view(&self) -> View<'_> {
        View(self.0.as_ref())
    }
}

impl Mat {
    /// A matrix from its entries.
    #[inline]
    pub fn from_fn(rows: usize, columns: usize, mut entry: impl FnMut(usize, usize) -> f64) -> Mat {
        let mut out = Mat::zeros(rows, columns);
        for column in 0..columns {
            out.col_mut(column).iter_mut().enumerate().for_each(|(row, to)| *to = entry(row, column));
        }
        out
    }

    /// A matrix of zeros.
    pub fn zeros(rows: usize, columns: usize) -> Mat {
        Mat(faer::Mat::zeros(rows, columns))
    }

    /// Ones on the diagonal, zeros elsewhere.
    pub fn identity(rows: usize, columns: usize) -> Mat {
        Mat(faer::Mat::identity(rows, columns))
    }

    /// A matrix of one column.
    pub fn column(values: &[f64]) -> Mat {
        Mat::from_fn(values.len(), 1, |i, _| values[i])
    }

    /// Number of rows.
    #[inline]
    pub fn nrows(&self) -> usize {
        self.0.nrows()
    }

    /// Number of columns.
    #[inline]
    pub fn ncols(&self) -> usize {
        self.0.ncols()
    }

    /// A column.
    #[inline]
    pub fn col(&self, column: usize) -> &[f64] {
        self.0.col_as_slice(column)
    }

    /// A column, to be changed.
    #[inline]
    pub fn col_mut(&mut self, column: usize) -> &mut [f64] {
        self.0.col_as_slice_mut(column)
    }

    /// All columns, from the first on.
    pub fn col_iter(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        (0..self.ncols()).map(|column| self.col(column))
    }

    /// Entries of a row.
    #[inline]
    pub fn row(&self, row: usize) -> impl ExactSizeIterator<Item = f64> {
        (0..self.ncols()).map(move |column| self[(row, column)])
    }

    /// The same with rows for columns, without a copy.
    pub fn transpose(&self) -> View<'_> {
        self.view().transpose()
    }

    /// Some rows.
    pub fn rows(&self, range: Range<usize>) -> View<'_> {
        self.view().rows(range)
    }

    /// Some columns.
    pub fn columns(&self, range: Range<usize>) -> View<'_> {
        self.view().columns(range)
    }

    /// Gives every entry the same value.
    pub fn fill(&mut self, value: f64) {
        self.0.fill(value);
    }

    /// Drops the columns from `columns` on.
    pub fn truncate_columns(&mut self, columns: usize) {
        self.0.truncate(self.nrows(), columns);
    }

    /// Writes a matrix over the rows from `first` on; as wide as this one.
    pub fn set_rows(&mut self, first: usize, from: &impl AsView) {
        self.set_rows_view(first, from.view());
    }

    fn set_rows_view(&mut self, first: usize, from: View<'_>) {
        self.0.subrows_mut(first, from.nrows()).copy_from(from.0);
    }

    /// `A v`.
    pub fn times(&self, v: &[f64]) -> Vec<f64> {
        let product = &self.0 * ColRef::from_slice(v);
        product.iter().copied().collect()
    }

    /// Root of the sum of squares of a column, without overflow.
    pub fn col_norm(&self, column: usize) -> f64 {
        self.0.col(column).norm_l2()
    }

    /// Sum of squares of a column.
    pub fn col_squares(&self, column: usize) -> f64 {
        self.0.col(column).squared_norm_l2()
    }

    /// Root of the sum of squares of all entries, without overflow.
    pub fn norm_l2(&self) -> f64 {
        self.0.norm_l2()
    }
}

impl View<'_> {
    /// A copy of its own.
    pub fn to_mat(self) -> Mat {
        Mat(self.0.to_owned())
    }
}

impl Index<(usize, usize)> for Mat {
    type Output = f64;

    #[inline]
    fn index(&self, at: (usize, usize)) -> &f64 {
        &self.0[at]
    }
}

impl IndexMut<(usize, usize)> for Mat {
    #[inline]
    fn index_mut(&mut self, at: (usize, usize)) -> &mut f64 {
        &mut self.0[at]
    }
}

impl std::fmt::Debug for Mat {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

/// `C = A B` of column-major slices, written over `out`: `A` of `rows × inner`, `B` of `inner × columns` entries.
///
/// Panics unless the lengths agree.
pub fn multiply_into(out: &mut [f64], a: &[f64], b: &[f64], (rows, inner, columns): (usize, usize, usize)) {
    matmul(
        MatMut::from_column_major_slice_mut(out, rows, columns),
        Accum::Replace,
        MatRef::from_column_major_slice(a, rows, inner),
        MatRef::from_column_major_slice(b, inner, columns),
        1.0,
        Par::Seq,
    );
}
