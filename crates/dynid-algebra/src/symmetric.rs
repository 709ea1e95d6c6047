//! Small symmetric matrices of fixed size: Cholesky factors, eigenvalues, singular values.
//!
//! Sizes 3 (tensors), 4 (pseudo-inertias) and 6 (spatial inertias) occur; everything lives on the stack.

/// Square matrix of fixed size, by rows.
pub type Square<const N: usize> = [[f64; N]; N];

/// Most sweeps of a Jacobi iteration; convergence is quadratic, so that six to eight do.
const SWEEPS: usize = 32;

/// Unit matrix.
pub fn identity<const N: usize>() -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }))
}

/// `a b`.
pub fn product<const N: usize>(a: &Square<N>, b: &Square<N>) -> Square<N> {
    let mut out = [[0.0; N]; N];
    for (row, a_row) in out.iter_mut().zip(a) {
        for (x, b_row) in a_row.iter().zip(b) {
            for (o, y) in row.iter_mut().zip(b_row) {
                *o += x * y;
            }
        }
    }
    out
}

/// `aᵀ`.
pub fn transpose<const N: usize>(a: &Square<N>) -> Square<N> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[j][i]))
}

/// `a s aᵀ` for symmetric `s`, symmetric to the last bit.
pub fn congruence<const N: usize>(a: &Square<N>, s: &Square<N>) -> Square<N> {
    let left = product(a, s);
    let mut out = [[0.0; N]; N];
    for i in 0..N {
        for j in 0..=i {
            out[i][j] = (0..N).map(|k| left[i][k] * a[j][k]).sum();
            out[j][i] = out[i][j];
        }
    }
    out
}

/// Trace inner product `⟨a, b⟩ = tr(aᵀ b)`.
pub fn inner<const N: usize>(a: &Square<N>, b: &Square<N>) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(x, y)| x * y).sum()
}

/// `tr a`.
pub fn trace<const N: usize>(a: &Square<N>) -> f64 {
    (0..N).map(|i| a[i][i]).sum()
}

/// Lower triangular `l` with `a = l lᵀ`; `None` unless `a` is positive definite to rounding.
pub fn cholesky<const N: usize>(a: &Square<N>) -> Option<Square<N>> {
    let mut l = [[0.0; N]; N];
    for j in 0..N {
        let pivot = a[j][j] - l[j][..j].iter().map(|x| x * x).sum::<f64>();
        // Written so that NaN fails too.
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        l[j][j] = pivot.sqrt();
        for i in j + 1..N {
            let dot: f64 = (0..j).map(|k| l[i][k] * l[j][k]).sum();
            l[i][j] = (a[i][j] - dot) / l[j][j];
        }
    }
    Some(l)
}

/// Inverse of a lower triangular matrix with non-zero diagonal.
pub fn lower_inverse<const N: usize>(l: &Square<N>) -> Square<N> {
    let mut inverse = [[0.0; N]; N];
    for j in 0..N {
        inverse[j][j] = 1.0 / l[j][j];
        for i in j + 1..N {
            let dot: f64 = (j..i).map(|k| l[i][k] * inverse[k][j]).sum();
            inverse[i][j] = -dot / l[i][i];
        }
    }
    inverse
}

/// Eigenvalues `d`, ascending, and eigenvectors `v` (columns) of a symmetric matrix: `a = v diag(d) vᵀ`.
///
/// Jacobi rotations, accurate to rounding relative to the largest eigenvalue.
pub fn eigen<const N: usize>(a: &Square<N>) -> ([f64; N], Square<N>) {
    let mut a = *a;
    let mut v = identity::<N>();
    diagonalise(&mut a, |p, q, c, s| turn(&mut v, p, q, c, s));
    let mut order: [usize; N] = std::array::from_fn(|i| i);
    order.sort_by(|i, j| a[*i][*i].total_cmp(&a[*j][*j]));
    (
        std::array::from_fn(|k| a[order[k]][order[k]]),
        std::array::from_fn(|i| std::array::from_fn(|k| v[i][order[k]])),
    )
}

/// Smallest eigenvalue of a symmetric matrix.
pub fn least_eigenvalue<const N: usize>(a: &Square<N>) -> f64 {
    let mut a = *a;
    diagonalise(&mut a, |_, _, _, _| {});
    let diagonal = (0..N).map(|i| a[i][i]);
    diagonal.min_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// Turns a symmetric matrix into a diagonal one; `turned`: columns, cosine and sine of every rotation.
fn diagonalise<const N: usize>(a: &mut Square<N>, mut turned: impl FnMut(usize, usize, f64, f64)) {
    for _ in 0..SWEEPS {
        let off: f64 = (0..N).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| a[i][j].abs()).sum();
        let size: f64 = (0..N).map(|i| a[i][i].abs()).sum();
        if off <= f64::EPSILON * size || off <= f64::MIN_POSITIVE || !off.is_finite() {
            break;
        }
        for p in 0..N {
            for q in p + 1..N {
                if a[p][q] == 0.0 {
                    continue;
                }
                let (c, s) = rotation((a[q][q] - a[p][p]) / (2.0 * a[p][q]));
                turn(a, p, q, c, s);
                let (x, y) = (a[p], a[q]);
                a[p] = std::array::from_fn(|k| c * x[k] - s * y[k]);
                a[q] = std::array::from_fn(|k| s * x[k] + c * y[k]);
                // What rounding leaves there would keep the sweeps going.
                (a[p][q], a[q][p]) = (0.0, 0.0);
                turned(p, q, c, s);
            }
        }
    }
}

/// Rotates two columns.
fn turn<const N: usize>(a: &mut Square<N>, p: usize, q: usize, c: f64, s: f64) {
    for row in a {
        (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
    }
}

/// A symmetric matrix whose small eigenvalues were raised.
#[derive(Debug, Clone, PartialEq)]
pub struct Raised<const N: usize> {
    /// The matrix with the raised eigenvalues.
    pub matrix: Square<N>,
    /// Eigenvalues before, ascending.
    pub eigenvalues: [f64; N],
    /// How many of them were raised.
    pub raised: usize,
}

/// Raises the eigenvalues of a symmetric matrix that are at most `zero · λ_max` to `share · λ_max`; eigenvectors stay.
///
/// Without an eigenvalue to raise the matrix comes back as it is. `None` if no eigenvalue is positive or an entry is not
/// finite. Panics unless `0 ≤ zero ≤ share`.
pub fn raise_eigenvalues<const N: usize>(matrix: &Square<N>, zero: f64, share: f64) -> Option<Raised<N>> {
    assert!(0.0 <= zero && zero <= share, "the floor lies above what counts as zero");
    if matrix.iter().flatten().any(|x| !x.is_finite()) {
        return None;
    }
    let (eigenvalues, vectors) = eigen(matrix);
    let largest = *eigenvalues.last().filter(|x| **x > 0.0)?;
    let raised = eigenvalues.iter().filter(|v| **v <= zero * largest).count();
    if raised == 0 {
        return Some(Raised { matrix: *matrix, eigenvalues, raised });
    }
    let mut lifted = [[0.0; N]; N];
    for (k, value) in eigenvalues.iter().enumerate() {
        lifted[k][k] = if k < raised { share * largest } else { *value };
    }
    Some(Raised { matrix: congruence(&vectors, &lifted), eigenvalues, raised })
}

/// Singular values `d` and right singular vectors `v` (columns) of a square matrix: columns of `a v` are orthogonal
/// with lengths `d`.
///
/// One-sided Jacobi rotations: small singular values of a graded matrix keep their relative accuracy.
///
/// Source: Demmel & Veselić 1992.
pub fn right_singular<const N: usize>(a: &Square<N>) -> ([f64; N], Square<N>) {
    let mut v = identity::<N>();
    let lengths = orthogonalise(a, |p, q, c, s| turn(&mut v, p, q, c, s));
    (lengths, v)
}

/// Singular values of a square matrix, as accurate as those of [`right_singular`], in its order.
pub fn singular_values<const N: usize>(a: &Square<N>) -> [f64; N] {
    orthogonalise(a, |_, _, _, _| {})
}

/// Lengths of the columns after rotations that make them orthogonal; `turned`: columns, cosine and sine of every rotation.
fn orthogonalise<const N: usize>(a: &Square<N>, mut turned: impl FnMut(usize, usize, f64, f64)) -> [f64; N] {
    let mut a = *a;
    for _ in 0..SWEEPS {
        let mut worst = 0.0_f64;
        for p in 0..N {
            for q in p + 1..N {
                let (mut pp, mut qq, mut pq) = (0.0, 0.0, 0.0);
                for row in &a {
                    pp += row[p] * row[p];
                    qq += row[q] * row[q];
                    pq += row[p] * row[q];
                }
                if pq == 0.0 {
                    continue;
                }
                let cosine = pq.abs() / (pp.sqrt() * qq.sqrt());
                worst = worst.max(cosine);
                if cosine <= 2.0 * f64::EPSILON {
                    continue;
                }
                let (c, s) = rotation((qq - pp) / (2.0 * pq));
                turn(&mut a, p, q, c, s);
                turned(p, q, c, s);
            }
        }
        if worst <= 16.0 * f64::EPSILON || worst.is_nan() {
            break;
        }
    }
    std::array::from_fn(|k| a.iter().map(|row| row[k] * row[k]).sum::<f64>().sqrt())
}

/// Cosine and sine of the rotation that annihilates an off-diagonal entry, from `cot 2θ`.
fn rotation(theta: f64) -> (f64, f64) {
    let t = if theta == 0.0 { 1.0 } else { theta.signum() / (theta.abs() + theta.hypot(1.0)) };
    let c = 1.0 / t.hypot(1.0);
    (c, t * c)
}

#[cfg(test)]
mod tests {
    use super::*;

    const A: Square<4> =
        [[4.0, 1.0, -2.0, 0.5], [1.0, 3.0, 0.2, 0.1], [-2.0, 0.2, 5.0, -1.0], [0.5, 0.1, -1.0, 2.0]];

    fn close<const N: usize>(a: &Square<N>, b: &Square<N>, tolerance: f64) {
        for (x, y) in a.iter().flatten().zip(b.iter().flatten()) {
            assert!((x - y).abs() <= tolerance, "{a:?} {b:?}");
        }
    }

    #[test]
    fn cholesky_and_its_inverse_give_back_the_matrix() {
        let l = cholesky(&A).expect("positive definite");
        close(&product(&l, &transpose(&l)), &A, 1e-14);
        close(&product(&l, &lower_inverse(&l)), &identity(), 1e-15);
        let mut indefinite = A;
        indefinite[3][3] = -1.0;
        assert_eq!(cholesky(&indefinite), None);
        indefinite[3][3] = f64::NAN;
        assert_eq!(cholesky(&indefinite), None);
    }

    #[test]
    fn eigenvectors_diagonalise() {
        let (d, v) = eigen(&A);
        let mut diagonal = [[0.0; 4]; 4];
        (0..4).for_each(|i| diagonal[i][i] = d[i]);
        close(&congruence(&v, &diagonal), &A, 1e-14);
        close(&product(&transpose(&v), &v), &identity(), 1e-15);
        assert!(d.is_sorted() && (d.iter().sum::<f64>() - trace(&A)).abs() < 1e-14);
        assert_eq!(least_eigenvalue(&A), d[0]);
    }

    #[test]
    fn raises_what_is_not_positive_and_nothing_else() {
        // Eigenvalues 3 (along (1, 1)) and -1 (along (1, -1)).
        let found = raise_eigenvalues(&[[1.0, 2.0], [2.0, 1.0]], 1e-9, 1e-3).unwrap();
        assert_eq!(found.raised, 1);
        assert!((found.eigenvalues[0] + 1.0).abs() < 1e-14 && (found.eigenvalues[1] - 3.0).abs() < 1e-14);
        let (low, high) = (3e-3, 3.0);
        assert!((found.matrix[0][0] - 0.5 * (high + low)).abs() < 1e-14);
        assert!((found.matrix[0][1] - 0.5 * (high - low)).abs() < 1e-14);

        let good = [[2.0, 0.5, 0.5], [0.5, 2.0, 0.5], [0.5, 0.5, 2.0]];
        assert_eq!(raise_eigenvalues(&good, 1e-9, 1e-3).unwrap().matrix, good);
    }

    #[test]
    fn nothing_positive_cannot_be_repaired() {
        assert_eq!(raise_eigenvalues(&[[0.0; 3]; 3], 0.0, 1e-3), None);
        assert_eq!(raise_eigenvalues(&[[f64::NAN]], 0.0, 1e-3), None);
    }

    #[test]
    fn singular_values_of_a_graded_matrix_are_relatively_accurate() {
        // diag(1, 1e-5, 1e-10, 1e-15) times an orthogonal matrix: the lengths of its rows.
        let (_, v) = eigen(&A);
        let graded: Square<4> =
            std::array::from_fn(|i| std::array::from_fn(|j| 10f64.powi(-5 * i as i32) * v[j][i]));
        let (mut d, right) = right_singular(&graded);
        assert_eq!(singular_values(&graded), d);
        close(&product(&transpose(&right), &right), &identity(), 1e-14);
        d.sort_by(|x, y| y.total_cmp(x));
        for (k, value) in d.iter().enumerate() {
            let expected = 10f64.powi(-5 * k as i32);
            assert!((value / expected - 1.0).abs() < 1e-9, "{k}: {value}");
        }
    }
}
