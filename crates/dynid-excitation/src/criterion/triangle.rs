//! Triangular factors, singular values and inverses of observation matrices.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{qr_in_place, qr_in_place_scratch};
use faer::linalg::svd::{ComputeSvdVectors, svd, svd_scratch};
use faer::{Mat, Par};

const PANEL: usize = 16;

/// Overwrites `w` (at least as tall as wide) and returns its upper triangle.
pub(crate) fn triangle(w: &mut Mat<f64>) -> Mat<f64> {
    let (rows, columns) = (w.nrows(), w.ncols());
    let height = rows.min(columns);
    let panel = PANEL.min(height).max(1);
    let mut reflectors = Mat::zeros(panel, height);
    let mut scratch =
        MemBuffer::new(qr_in_place_scratch::<f64>(rows, columns, panel, Par::Seq, Default::default()));
    qr_in_place(w.as_mut(), reflectors.as_mut(), Par::Seq, MemStack::new(&mut scratch), Default::default());
    Mat::from_fn(columns, columns, |i, j| if i <= j && i < height { w[(i, j)] } else { 0.0 })
}

/// Singular values of a square matrix, descending, and its right singular vectors as columns if wanted. `None` if the
/// iteration fails (it does not for finite numbers).
pub(crate) fn singular_values(a: &Mat<f64>, vectors: bool) -> Option<(Vec<f64>, Mat<f64>)> {
    let n = a.nrows();
    let none = ComputeSvdVectors::No;
    let right = if vectors { ComputeSvdVectors::Full } else { none };
    let mut scratch = MemBuffer::new(svd_scratch::<f64>(n, n, none, right, Par::Seq, Default::default()));
    let mut values = faer::diag::Diag::<f64>::zeros(n);
    let mut v = Mat::zeros(n, if vectors { n } else { 0 });
    svd(
        a.as_ref(),
        values.as_mut(),
        None,
        vectors.then(|| v.as_mut()),
        Par::Seq,
        MemStack::new(&mut scratch),
        Default::default(),
    )
    .ok()?;
    Some(((0..n).map(|i| values[i]).collect(), v))
}

/// Inverse of an upper triangle; `None` if a diagonal entry is zero.
pub(crate) fn inverse(r: &Mat<f64>) -> Option<Mat<f64>> {
    let n = r.nrows();
    let mut inverse = Mat::<f64>::identity(n, n);
    for j in 0..n {
        for i in (0..=j).rev() {
            let mut sum = if i == j { 1.0 } else { 0.0 };
            for k in i + 1..=j {
                sum -= r[(i, k)] * inverse[(k, j)];
            }
            if r[(i, i)] == 0.0 {
                return None;
            }
            inverse[(i, j)] = sum / r[(i, i)];
        }
    }
    Some(inverse)
}
