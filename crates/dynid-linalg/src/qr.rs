//! Orthogonal triangles of rectangular matrices.

use crate::{AsView, Mat, View};
use faer::Par;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::{col_pivoting, no_pivoting};
use faer::linalg::solvers::{ColPivQr, Qr as Whole, Solve, SolveLstsq};

/// Width of the panels of Householder reflectors.
pub(crate) const PANEL: usize = 16;

/// `A = Q R`.
#[derive(Debug, Clone)]
pub struct Qr(Whole<f64>);

impl Mat {
    /// `A = Q R`.
    pub fn qr(&self) -> Qr {
        Qr::new(self)
    }

    /// `A P = Q R`, columns in the order of the length they have left.
    pub fn pivoted_qr(&self) -> PivotedQr {
        PivotedQr::new(self)
    }
}

impl Qr {
    pub(crate) fn new(a: &Mat) -> Self {
        Qr(a.0.qr())
    }

    /// `Q`, square.
    pub fn q(&self) -> Mat {
        Mat(self.0.compute_Q())
    }

    /// `R`, as many rows as the shorter side.
    pub fn r(&self) -> View<'_> {
        View(self.0.thin_R())
    }

    /// `argmin ‖A X - B‖` of a matrix at least as tall as wide, of full rank.
    pub fn solve_least_squares(&self, b: &impl AsView) -> Mat {
        self.solve_view(b.view())
    }

    fn solve_view(&self, b: View<'_>) -> Mat {
        Mat(self.0.solve_lstsq(b.0))
    }
}

/// `A P = Q R`, columns in the order of the length they have left.
#[derive(Debug, Clone)]
pub struct PivotedQr(ColPivQr<f64>);

impl PivotedQr {
    /// Of a matrix or a part of one.
    pub fn new(a: &impl AsView) -> Self {
        PivotedQr::of(a.view())
    }

    fn of(a: View<'_>) -> Self {
        PivotedQr(a.0.col_piv_qr())
    }

    /// `R`, as tall as `A`.
    pub fn r(&self) -> View<'_> {
        View(self.0.R())
    }

    /// As many columns of `Q` as the shorter side of the matrix has.
    pub fn thin_q(&self) -> Mat {
        Mat(self.0.compute_thin_Q())
    }

    /// `A⁻¹ B` of a square matrix.
    pub fn solve(&self, b: &impl AsView) -> Mat {
        self.solve_view(b.view())
    }

    fn solve_view(&self, b: View<'_>) -> Mat {
        Mat(self.0.solve(b.0))
    }
}

/// Order in which column-pivoted QR takes the columns of a square matrix, and the diagonal of `|R|`.
pub fn pivots(mut matrix: Mat) -> (Vec<usize>, Vec<f64>) {
    use col_pivoting::factor::{qr_in_place, qr_in_place_scratch};
    let n = matrix.nrows();
    let mut reflectors = faer::Mat::zeros(1, n);
    let (mut order, mut inverse) = (vec![0_usize; n], vec![0_usize; n]);
    let mut scratch =
        MemBuffer::new(qr_in_place_scratch::<usize, f64>(n, n, 1, Par::Seq, Default::default()));
    qr_in_place(
        matrix.0.as_mut(),
        reflectors.as_mut(),
        &mut order,
        &mut inverse,
        Par::Seq,
        MemStack::new(&mut scratch),
        Default::default(),
    );
    let diagonal = (0..n).map(|i| matrix[(i, i)].abs()).collect();
    (order, diagonal)
}

/// Working memory of QR in place, for one matrix after the other.
pub struct QrRoom {
    reflectors: faer::Mat<f64>,
    scratch: MemBuffer,
}

impl std::fmt::Debug for QrRoom {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("QrRoom").field("columns", &self.reflectors.ncols()).finish_non_exhaustive()
    }
}

impl QrRoom {
    /// Room for matrices of up to this size.
    pub fn new(rows: usize, columns: usize) -> Self {
        let panel = PANEL.min(columns).max(1);
        let scratch = no_pivoting::factor::qr_in_place_scratch::<f64>(
            rows,
            columns,
            panel,
            Par::Seq,
            Default::default(),
        );
        QrRoom { reflectors: faer::Mat::zeros(panel, columns), scratch: MemBuffer::new(scratch) }
    }

    /// Overwrites the first `rows` rows of a matrix: `R` on and above the diagonal, reflectors below it.
    ///
    /// Panics if there are fewer rows, or the matrix is larger than the room was made for.
    pub fn reduce(&mut self, matrix: &mut Mat, rows: usize) {
        let height = rows.min(matrix.ncols());
        no_pivoting::factor::qr_in_place(
            matrix.0.subrows_mut(0, rows),
            self.reflectors.get_mut(..PANEL.min(height).max(1), ..height),
            Par::Seq,
            MemStack::new(&mut self.scratch),
            Default::default(),
        );
    }
}
