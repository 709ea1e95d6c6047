//! `Qᵀ` kept as reflectors, to be applied to columns that come later.

use crate::Mat;
use crate::qr::PANEL;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::householder::{
    apply_block_householder_sequence_transpose_on_the_left_in_place_scratch as rotation_scratch,
    apply_block_householder_sequence_transpose_on_the_left_in_place_with_conj as rotate,
};
use faer::linalg::qr::no_pivoting::factor::{qr_in_place, qr_in_place_scratch};
use faer::{Conj, MatMut, Par};

/// `A = Q R` with `Q` as Householder reflectors.
#[derive(Debug, Clone)]
pub struct Reflectors {
    /// `R` on and above the diagonal, reflectors below.
    basis: Mat,
    blocks: faer::Mat<f64>,
}

impl Reflectors {
    /// Reduces a matrix of any shape.
    pub fn of(mut matrix: Mat) -> Self {
        let (rows, columns) = (matrix.nrows(), matrix.ncols());
        let height = rows.min(columns);
        let panel = PANEL.min(height.max(1));
        let mut blocks = faer::Mat::zeros(panel, height);
        if height > 0 {
            let scratch = qr_in_place_scratch::<f64>(rows, columns, panel, Par::Seq, Default::default());
            qr_in_place(
                matrix.0.as_mut(),
                blocks.as_mut(),
                Par::Seq,
                MemStack::new(&mut MemBuffer::new(scratch)),
                Default::default(),
            );
        }
        Reflectors { basis: matrix, blocks }
    }

    /// Rows of `R`: the shorter side of the matrix.
    pub fn height(&self) -> usize {
        self.blocks.ncols()
    }

    /// Entry of `R`.
    pub fn r(&self, row: usize, column: usize) -> f64 {
        if row <= column { self.basis[(row, column)] } else { 0.0 }
    }

    /// `Qᵀ B` written over `B`, column-major, as tall as the matrix was. Panics unless it holds whole columns.
    pub fn apply_transposed(&self, columns: &mut [f64]) {
        let rows = self.basis.nrows();
        if self.height() == 0 {
            return;
        }
        assert!(columns.len().is_multiple_of(rows), "whole columns");
        let width = columns.len() / rows;
        let scratch = rotation_scratch::<f64>(rows, self.blocks.nrows(), width);
        rotate(
            self.basis.0.as_ref(),
            self.blocks.as_ref(),
            Conj::No,
            MatMut::from_column_major_slice_mut(columns, rows, width),
            Par::Seq,
            MemStack::new(&mut MemBuffer::new(scratch)),
        );
    }
}
