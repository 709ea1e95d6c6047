//! Where an estimator keeps its information.

use crate::downdating::RowWindow;
use crate::forgetting::Forgetting;
use crate::square_root::SquareRoot;
use crate::window::BlockWindow;
use dynid_words::Transfer;

/// Where information is kept.
#[derive(Debug, Clone)]
pub(crate) enum Memory {
    Recursive(SquareRoot),
    Blocks(BlockWindow),
    Rows(RowWindow),
}

impl Memory {
    /// Memory for samples of up to `rows` rows that starts from `root`.
    pub(crate) fn new(forgetting: &Forgetting, root: SquareRoot, rows: usize) -> Self {
        match *forgetting {
            Forgetting::BlockWindow { samples, blocks } => {
                Memory::Blocks(BlockWindow::new(root, samples / blocks, blocks, rows))
            }
            Forgetting::RowWindow { samples, blocks } => {
                Memory::Rows(RowWindow::new(root, samples / blocks, blocks, rows))
            }
            _ => Memory::Recursive(root),
        }
    }

    pub(crate) fn root(&self) -> &SquareRoot {
        match self {
            Memory::Recursive(root) => root,
            Memory::Blocks(window) => window.total(),
            Memory::Rows(window) => window.total(),
        }
    }

    /// Adds rows; a recursive memory uses them up.
    pub(crate) fn push(&mut self, rows: &mut [f64]) {
        match self {
            Memory::Recursive(root) => root.push(rows),
            Memory::Blocks(window) => window.push(rows),
            Memory::Rows(window) => window.push(rows),
        }
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        match self {
            Memory::Recursive(root) => root.transfer(transfer),
            Memory::Blocks(window) => window.transfer(transfer),
            Memory::Rows(window) => window.transfer(transfer),
        }
    }
}
