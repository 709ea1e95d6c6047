//! The last samples alone, without removing any.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::SquareRoot;
use dynid_words::Transfer;

/// Window over whole blocks of samples, kept in two stacks.
///
/// The back takes closed blocks and their sum, the front holds sums of all blocks from each one on. The total
/// is one of the front, the back's sum and the open block: nothing is ever subtracted, so the window is as
/// accurate as a batch factorisation. Two merges per block on average; when the front runs out, the back's
/// blocks are summed into it at once (`blocks` merges).
///
/// With blocks of `L` samples the total is of the last `samples - L + 1` to `samples` samples, and of the
/// prior.
#[derive(Debug, Clone)]
pub struct BlockWindow {
    block_samples: usize,
    prior: SquareRoot,
    /// Sums: entry `i` is of the `i + 1` newest blocks of the front, the last one of all.
    front: Vec<SquareRoot>,
    front_blocks: usize,
    back: Vec<SquareRoot>,
    back_blocks: usize,
    back_sum: SquareRoot,
    open: SquareRoot,
    open_samples: usize,
    total: SquareRoot,
    none: SquareRoot,
    rows: Vec<f64>,
    scratch: Vec<f64>,
}

impl BlockWindow {
    /// Window of `blocks` blocks of `block_samples` samples with up to `rows` rows each, beside a prior that
    /// always counts.
    ///
    /// Panics unless all three are positive.
    pub fn new(prior: SquareRoot, block_samples: usize, blocks: usize, rows: usize) -> Self {
        assert!(block_samples > 0 && blocks > 0 && rows > 0, "a window has blocks, samples and rows");
        let p = prior.columns();
        let none = SquareRoot::new(p);
        Self {
            block_samples,
            front: vec![none.clone(); blocks],
            front_blocks: 0,
            back: vec![none.clone(); blocks],
            back_blocks: 0,
            back_sum: none.clone(),
            open: none.clone(),
            open_samples: 0,
            total: prior.clone(),
            none,
            prior,
            rows: vec![0.0; rows * (p + 1)],
            scratch: vec![0.0; p * (p + 1)],
        }
    }

    /// Information of the window and the prior.
    pub fn total(&self) -> &SquareRoot {
        &self.total
    }

    /// Samples that the total holds.
    pub fn samples(&self) -> usize {
        (self.front_blocks + self.back_blocks) * self.block_samples + self.open_samples
    }

    /// Adds a sample: weighted rows `[φ y]`.
    pub fn push(&mut self, rows: &[f64]) {
        if self.open_samples == self.block_samples {
            self.close();
        }
        let copy = &mut self.rows[..rows.len()];
        copy.copy_from_slice(rows);
        self.open.push(copy);
        copy.copy_from_slice(rows);
        self.total.push(copy);
        self.open_samples += 1;
    }

    /// Closes the open block, drops the oldest one if there are too many, and sums anew.
    fn close(&mut self) {
        self.back[self.back_blocks].copy_from(&self.open);
        self.back_blocks += 1;
        self.back_sum.merge(&self.open, &mut self.scratch);
        self.open.copy_from(&self.none);
        self.open_samples = 0;
        if self.front_blocks + self.back_blocks == self.back.len() {
            self.drop_oldest();
        }
        self.total.copy_from(&self.prior);
        if let Some(newest) = self.front_blocks.checked_sub(1) {
            self.total.merge(&self.front[newest], &mut self.scratch);
        }
        self.total.merge(&self.back_sum, &mut self.scratch);
    }

    fn drop_oldest(&mut self) {
        if self.front_blocks == 0 {
            for block in self.back[..self.back_blocks].iter().rev() {
                let (older, own) = self.front.split_at_mut(self.front_blocks);
                own[0].copy_from(block);
                if let Some(later) = older.last() {
                    own[0].merge(later, &mut self.scratch);
                }
                self.front_blocks += 1;
            }
            self.back_blocks = 0;
            self.back_sum.copy_from(&self.none);
        }
        self.front_blocks -= 1;
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        let blocks = self.back.len();
        transfer.count(&mut self.front_blocks, blocks + 1);
        transfer.count(&mut self.back_blocks, blocks + 1);
        transfer.count(&mut self.open_samples, self.block_samples + 1);
        if self.front_blocks + self.back_blocks >= blocks {
            transfer.fail();
        }
        for stack in [&mut self.front, &mut self.back] {
            stack.iter_mut().for_each(|root| root.transfer(transfer));
        }
        for root in [&mut self.prior, &mut self.back_sum, &mut self.open, &mut self.total] {
            root.transfer(transfer);
        }
    }
}
