//! Parts of matrices, and matrices the other way round.

use std::ops::{Index, Range};

use faer::MatRef;

/// A part of a [`Mat`](crate::Mat) or its transpose, without a copy.
#[derive(Clone, Copy)]
pub struct View<'a>(pub(crate) MatRef<'a, f64>);

/// What can stand in products and sums: a matrix or a part of one.
pub trait AsView {
    /// The whole of it.
    fn view(&self) -> View<'_>;
}

impl AsView for View<'_> {
    fn view(&self) -> View<'_> {
        *self
    }
}

impl<T: AsView> AsView for &T {
    fn view(&self) -> View<'_> {
        (**self).view()
    }
}

impl<'a> View<'a> {
    /// Number of rows.
    pub fn nrows(&self) -> usize {
        self.0.nrows()
    }

    /// Number of columns.
    pub fn ncols(&self) -> usize {
        self.0.ncols()
    }

    /// The same with rows for columns.
    pub fn transpose(self) -> View<'a> {
        View(self.0.transpose())
    }

    /// Some rows. Panics unless there are such.
    pub fn rows(self, range: Range<usize>) -> View<'a> {
        View(self.0.subrows(range.start, range.len()))
    }

    /// Some columns. Panics unless there are such.
    pub fn columns(self, range: Range<usize>) -> View<'a> {
        View(self.0.subcols(range.start, range.len()))
    }

    /// Largest absolute value of an entry.
    pub fn norm_max(self) -> f64 {
        self.0.norm_max()
    }
}

impl Index<(usize, usize)> for View<'_> {
    type Output = f64;

    fn index(&self, at: (usize, usize)) -> &f64 {
        &self.0[at]
    }
}

impl std::fmt::Debug for View<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}
