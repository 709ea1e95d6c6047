//! Triangles of stacked rows.

use dynid_linalg::{AsView, Mat, QrRoom, View};

/// `R` of the QR of matrices of the same width stacked over one another, with `R_ii ≥ 0`; as many rows as it needs.
pub(crate) fn triangle(parts: &[View<'_>]) -> Mat {
    let width = parts.first().map_or(0, |part| part.ncols());
    let rows: usize = parts.iter().map(|part| part.nrows()).sum();
    let mut stacked = Mat::zeros(rows, width);
    let mut first = 0;
    for part in parts {
        stacked.set_rows(first, part);
        first += part.nrows();
    }
    of_stacked(stacked)
}

/// As [`triangle`], of one matrix that is used up.
pub(crate) fn of_stacked(mut stacked: Mat) -> Mat {
    let (rows, width) = (stacked.nrows(), stacked.ncols());
    QrRoom::new(rows, width).reduce(&mut stacked, rows);
    let height = rows.min(width);
    let signs: Vec<f64> = (0..height).map(|i| if stacked[(i, i)] < 0.0 { -1.0 } else { 1.0 }).collect();
    Mat::from_fn(height, width, |i, j| if j < i { 0.0 } else { signs[i] * stacked[(i, j)] })
}

/// Rows and columns of a matrix from `(row, column)` on; rows beyond it are left out.
pub(crate) fn corner(matrix: &Mat, row: usize, column: usize) -> Mat {
    let rows = matrix.nrows().saturating_sub(row);
    Mat::from_fn(rows, matrix.ncols() - column, |i, j| matrix[(row + i, column + j)])
}

/// The first rows of a matrix, filled up by zeros.
pub(crate) fn head(matrix: &Mat, rows: usize) -> Mat {
    Mat::from_fn(rows, matrix.ncols(), |i, j| if i < matrix.nrows() { matrix[(i, j)] } else { 0.0 })
}

/// A matrix with `columns` columns of zeros before it.
pub(crate) fn behind(matrix: &Mat, columns: usize) -> Mat {
    Mat::from_fn(matrix.nrows(), columns + matrix.ncols(), |i, j| {
        if j < columns { 0.0 } else { matrix[(i, j - columns)] }
    })
}

/// Sum of the squares of the entries.
pub(crate) fn squares(values: impl IntoIterator<Item = f64>) -> f64 {
    values.into_iter().map(|v| v * v).sum()
}

/// `A v` for the first columns of `A`, as many as `v` has entries.
pub(crate) fn times(a: &impl AsView, v: &[f64]) -> Vec<f64> {
    let a = a.view();
    (a.columns(0..v.len()) * Mat::column(v)).col(0).to_vec()
}
