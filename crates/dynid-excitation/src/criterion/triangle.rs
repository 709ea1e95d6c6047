//! Triangular factors, singular values and inverses of observation matrices.

use dynid_linalg::{Mat, QrRoom, right_singular};

/// Overwrites `w` (at least as tall as wide) and returns its upper triangle.
pub(crate) fn triangle(w: &mut Mat) -> Mat {
    let (rows, columns) = (w.nrows(), w.ncols());
    let height = rows.min(columns);
    QrRoom::new(rows, columns).reduce(w, rows);
    Mat::from_fn(columns, columns, |i, j| if i <= j && i < height { w[(i, j)] } else { 0.0 })
}

/// Singular values of a square matrix, descending, and its right singular vectors as columns if wanted. `None` if the
/// iteration fails (it does not for finite numbers).
pub(crate) fn singular_values(a: &Mat, vectors: bool) -> Option<(Vec<f64>, Mat)> {
    match vectors {
        true => right_singular(a),
        false => Some((a.singular_values()?, Mat::zeros(a.nrows(), 0))),
    }
}

/// Inverse of an upper triangle; `None` if a diagonal entry is zero.
pub(crate) fn inverse(r: &Mat) -> Option<Mat> {
    let n = r.nrows();
    let mut inverse = Mat::identity(n, n);
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
