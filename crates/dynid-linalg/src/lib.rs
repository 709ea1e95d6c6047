//! Dense linear algebra: the matrix of results, upper triangles, sums over vectors.

pub mod triangular;
pub mod vector;

/// Dense matrix of results (column-major, indexed `m[(row, column)]`).
pub use faer::Mat;
