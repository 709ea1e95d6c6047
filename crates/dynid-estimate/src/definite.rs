//! Symmetric matrices made positive definite.

use faer::{Mat, Side};

use crate::triangular::symmetric_from;

/// A symmetric matrix whose small eigenvalues were raised.
#[derive(Debug, Clone, PartialEq)]
pub struct Raised {
    /// The matrix with the raised eigenvalues.
    pub matrix: Mat<f64>,
    /// Eigenvalues before, ascending.
    pub eigenvalues: Vec<f64>,
    /// How many of them were raised.
    pub raised: usize,
}

/// Raises the eigenvalues of a symmetric matrix that are at most `zero · λ_max` to `share · λ_max`; eigenvectors stay.
///
/// Only the lower triangle is read; without an eigenvalue to raise the matrix comes back as it is. `None` if no
/// eigenvalue is positive or an entry is not finite.
///
/// Panics unless the matrix is square and `0 ≤ zero ≤ share`.
pub fn raise_eigenvalues(matrix: &Mat<f64>, zero: f64, share: f64) -> Option<Raised> {
    let n = matrix.nrows();
    assert_eq!(n, matrix.ncols(), "a square matrix");
    assert!(0.0 <= zero && zero <= share, "the floor lies above what counts as zero");
    if (0..n).any(|j| (j..n).any(|i| !matrix[(i, j)].is_finite())) {
        return None;
    }
    let decomposition = matrix.self_adjoint_eigen(Side::Lower).ok()?;
    let (vectors, values) = (decomposition.U(), decomposition.S());
    let eigenvalues: Vec<f64> = (0..n).map(|k| values[k]).collect();
    let largest = *eigenvalues.last()?;
    if largest <= 0.0 {
        return None;
    }
    let raised = eigenvalues.iter().filter(|v| **v <= zero * largest).count();
    if raised == 0 {
        return Some(Raised { matrix: matrix.clone(), eigenvalues, raised });
    }
    let lifted = |k: usize| if k < raised { share * largest } else { eigenvalues[k] };
    let matrix =
        symmetric_from(n, |i, j| (0..n).map(|k| vectors[(i, k)] * lifted(k) * vectors[(j, k)]).sum());
    Some(Raised { matrix, eigenvalues, raised })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn raises_what_is_not_positive_and_nothing_else() {
        // Eigenvalues 3 (along (1, 1)) and -1 (along (1, -1)).
        let matrix = Mat::from_fn(2, 2, |i, j| if i == j { 1.0 } else { 2.0 });
        let found = raise_eigenvalues(&matrix, 1e-9, 1e-3).unwrap();
        assert_eq!(found.raised, 1);
        assert!((found.eigenvalues[0] + 1.0).abs() < 1e-14 && (found.eigenvalues[1] - 3.0).abs() < 1e-14);
        let (low, high) = (3e-3, 3.0);
        assert!((found.matrix[(0, 0)] - 0.5 * (high + low)).abs() < 1e-14);
        assert!((found.matrix[(0, 1)] - 0.5 * (high - low)).abs() < 1e-14);

        let good = Mat::from_fn(3, 3, |i, j| if i == j { 2.0 } else { 0.5 });
        assert_eq!(raise_eigenvalues(&good, 1e-9, 1e-3).unwrap().matrix, good);
    }

    #[test]
    fn nothing_positive_cannot_be_repaired() {
        assert_eq!(raise_eigenvalues(&Mat::zeros(3, 3), 0.0, 1e-3), None);
        assert_eq!(raise_eigenvalues(&Mat::from_fn(1, 1, |_, _| f64::NAN), 0.0, 1e-3), None);
    }
}
