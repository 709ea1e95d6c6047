//! Symmetric matrices.

use crate::Mat;
use faer::Side;

/// `A = U diag(values) Uᵀ` of a symmetric matrix.
#[derive(Debug, Clone)]
pub struct SymmetricEigen {
    /// Eigenvalues, ascending.
    pub values: Vec<f64>,
    /// Eigenvectors of unit length, column by column.
    pub vectors: Mat,
}

impl Mat {
    /// Eigenvalues and eigenvectors from the lower half of a symmetric matrix; `None` if the iteration fails.
    pub fn symmetric_eigen(&self) -> Option<SymmetricEigen> {
        SymmetricEigen::new(self)
    }
}

impl SymmetricEigen {
    pub(crate) fn new(a: &Mat) -> Option<Self> {
        let found = a.0.self_adjoint_eigen(Side::Lower).ok()?;
        Some(SymmetricEigen {
            values: found.S().column_vector().iter().copied().collect(),
            vectors: Mat(found.U().to_owned()),
        })
    }
}
