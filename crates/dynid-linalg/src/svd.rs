//! Singular values and vectors.

use crate::{AsView, Mat};
use faer::Par;
use faer::diag::Diag;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};

/// `A = U diag(values) Vᵀ`.
#[derive(Debug, Clone)]
pub struct Svd {
    /// Left singular vectors, column by column.
    pub u: Mat,
    /// Singular values, descending.
    pub values: Vec<f64>,
    /// Right singular vectors, column by column.
    pub v: Mat,
}

impl Mat {
    /// `A = U S Vᵀ` with square `U` and `V`; `None` if the iteration fails, which takes entries that are not finite.
    pub fn svd(&self) -> Option<Svd> {
        Svd::full(self)
    }

    /// As [`Self::svd`], with no more columns of `U` and `V` than there are singular values.
    pub fn thin_svd(&self) -> Option<Svd> {
        Svd::thin(self)
    }

    /// Singular values, descending; `None` if the iteration fails.
    pub fn singular_values(&self) -> Option<Vec<f64>> {
        self.0.singular_values().ok()
    }
}

impl Svd {
    pub(crate) fn full(a: &Mat) -> Option<Self> {
        a.0.svd().ok().map(Svd::of)
    }

    pub(crate) fn thin(a: &Mat) -> Option<Self> {
        a.0.thin_svd().ok().map(Svd::of)
    }

    fn of(found: faer::linalg::solvers::Svd<f64>) -> Self {
        Svd {
            u: Mat(found.U().to_owned()),
            values: found.S().column_vector().iter().copied().collect(),
            v: Mat(found.V().to_owned()),
        }
    }
}

/// Singular values of a square matrix, descending, and its right singular vectors as columns, without the work for the left ones.
/// `None` if the iteration fails (it does not for finite numbers).
pub fn right_singular(a: &Mat) -> Option<(Vec<f64>, Mat)> {
    let n = a.nrows();
    let (none, full) = (ComputeSvdVectors::No, ComputeSvdVectors::Full);
    let mut scratch = MemBuffer::new(svd_scratch::<f64>(n, n, none, full, Par::Seq, Default::default()));
    let mut values = Diag::<f64>::zeros(n);
    let mut v = faer::Mat::zeros(n, n);
    let room = MemStack::new(&mut scratch);
    svd(a.view().0, values.as_mut(), None, Some(v.as_mut()), Par::Seq, room, Default::default()).ok()?;
    Some(((0..n).map(|i| values[i]).collect(), Mat(v)))
}
