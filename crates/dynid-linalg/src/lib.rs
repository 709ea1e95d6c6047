//! Dense linear algebra: matrices, their products and decompositions, triangles, sums over vectors.
//!
//! | question | item |
//! |---|---|
//! | a matrix, parts of it, products and sums | [`Mat`], [`View`] |
//! | systems that are symmetric and positive definite, any square, overdetermined | [`Cholesky`], [`Lu`], [`Qr`], [`PivotedQr`] |
//! | singular values and vectors, eigenvalues of symmetric matrices | [`Svd`], [`SymmetricEigen`] |
//! | QR in place, again and again in the same memory; `Qᵀ` as reflectors | [`QrRoom`], [`Reflectors`] |
//! | triangles | [`triangular`] |
//! | sums over vectors | [`vector`] |
//!
//! Everything runs on the thread that calls it, so that sums have one order and results the same bits for any number of threads.
//! The room is the only one that names the library behind it (`faer`); signatures above it hold [`Mat`]. Generic doors hand a [`View`] to
//! a function without parameters, so that the library is compiled here alone, at this room's level.

mod cholesky;
mod eigen;
mod lu;
mod mat;
mod operators;
mod qr;
mod reflectors;
mod svd;
pub mod triangular;
pub mod vector;
mod view;

pub use cholesky::Cholesky;
pub use eigen::SymmetricEigen;
pub use lu::Lu;
pub use mat::{Mat, multiply_into};
pub use qr::{PivotedQr, Qr, QrRoom, pivots};
pub use reflectors::Reflectors;
pub use svd::{Svd, right_singular};
pub use view::{AsView, View};
