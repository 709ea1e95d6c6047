//! Substitution with small triangles, and their inverses.

use crate::{AsView, Mat, View};
use faer::Par;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};

/// `R⁻¹ B` written over `B`. The diagonal of `r` must not hold zeros.
pub fn solve_upper_in_place(r: &Mat, b: &mut Mat) {
    solve_upper_triangular_in_place(r.0.as_ref(), b.0.as_mut(), Par::Seq);
}

/// `L⁻¹ B` written over `B`. The diagonal of `l` must not hold zeros.
pub fn solve_lower_in_place(l: &impl AsView, b: &mut Mat) {
    solve_lower_view(l.view(), b);
}

fn solve_lower_view(l: View<'_>, b: &mut Mat) {
    solve_lower_triangular_in_place(l.0, b.0.as_mut(), Par::Seq);
}

/// `R⁻¹ B`. The diagonal of `r` must not hold zeros.
pub fn solve_upper(r: &Mat, b: &Mat) -> Mat {
    let mut x = b.clone();
    solve_upper_in_place(r, &mut x);
    x
}

/// `R⁻¹`, upper triangular.
pub fn inverse(r: &Mat) -> Mat {
    solve_upper(r, &Mat::identity(r.nrows(), r.ncols()))
}

/// `(RᵀR)⁻¹ = R⁻¹R⁻ᵀ`.
pub fn gram_inverse(r: &Mat) -> Mat {
    let inverse = inverse(r);
    symmetric_from(r.nrows(), |i, j| (j..r.nrows()).map(|k| inverse[(i, k)] * inverse[(j, k)]).sum())
}

/// Symmetric `n × n` matrix from its upper entries `i ≤ j`.
pub fn symmetric_from(n: usize, upper: impl Fn(usize, usize) -> f64) -> Mat {
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
