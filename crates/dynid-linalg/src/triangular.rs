//! Substitution with small upper triangles, and their inverses.

use faer::Mat;
use faer::Par;
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;

/// `R⁻¹ B`. The diagonal of `r` must not hold zeros.
pub fn solve_upper(r: &Mat<f64>, b: &Mat<f64>) -> Mat<f64> {
    let mut x = b.clone();
    solve_upper_triangular_in_place(r.as_ref(), x.as_mut(), Par::Seq);
    x
}

/// `R⁻¹`, upper triangular.
pub fn inverse(r: &Mat<f64>) -> Mat<f64> {
    solve_upper(r, &Mat::identity(r.nrows(), r.ncols()))
}

/// `(RᵀR)⁻¹ = R⁻¹R⁻ᵀ`.
pub fn gram_inverse(r: &Mat<f64>) -> Mat<f64> {
    let inverse = inverse(r);
    symmetric_from(r.nrows(), |i, j| (j..r.nrows()).map(|k| inverse[(i, k)] * inverse[(j, k)]).sum())
}

/// Symmetric `n × n` matrix from its upper entries `i ≤ j`.
pub fn symmetric_from(n: usize, upper: impl Fn(usize, usize) -> f64) -> Mat<f64> {
    let mut matrix = Mat::zeros(n, n);
    for j in 0..n {
        for i in 0..=j {
            let value = upper(i, j);
            matrix[(i, j)] = value;
            matrix[(j, i)] = value;
        }
    }
    matrix
}
