//! Square matrices.

use crate::{AsView, Mat, View};
use faer::linalg::solvers::{DenseSolveCore, FullPivLu, PartialPivLu, Solve};

/// `A = L U` of a square matrix, with exchanges. A singular matrix gives solutions that are not finite.
#[derive(Debug, Clone)]
pub struct Lu(Kind);

#[derive(Debug, Clone)]
enum Kind {
    Rows(PartialPivLu<f64>),
    Full(FullPivLu<f64>),
}

impl Mat {
    /// `A = L U` of a square matrix, rows exchanged.
    pub fn lu(&self) -> Lu {
        Lu::new(self)
    }

    /// `A = L U` of a square matrix, rows and columns exchanged.
    pub fn full_lu(&self) -> Lu {
        Lu::full(self)
    }
}

impl Lu {
    pub(crate) fn new(a: &Mat) -> Self {
        Lu(Kind::Rows(a.0.partial_piv_lu()))
    }

    pub(crate) fn full(a: &Mat) -> Self {
        Lu(Kind::Full(a.0.full_piv_lu()))
    }

    /// `A⁻¹ B`.
    pub fn solve(&self, b: &impl AsView) -> Mat {
        self.solve_view(b.view())
    }

    fn solve_view(&self, b: View<'_>) -> Mat {
        Mat(match &self.0 {
            Kind::Rows(lu) => lu.solve(b.0),
            Kind::Full(lu) => lu.solve(b.0),
        })
    }

    /// `A⁻¹`, where every entry of it is wanted.
    pub fn inverse(&self) -> Mat {
        Mat(match &self.0 {
            Kind::Rows(lu) => lu.inverse(),
            Kind::Full(lu) => lu.inverse(),
        })
    }
}
