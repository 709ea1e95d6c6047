//! The last samples alone, one by one.

use alloc::vec;
use alloc::vec::Vec;

use crate::square_root::SquareRoot;
use crate::window::BlockWindow;
use dynid_words::Transfer;

/// `|s|` of a hyperbolic rotation beyond which the factor is refreshed at once.
const STEEPEST: f64 = 1.0 - 1e-8;
/// Relative error, as estimated from the rotations, beyond which the factor is refreshed.
const LARGEST_ERROR: f64 = 1e-11;

/// Removes the weighted row `[φ y]` from a factor that holds it, by mixed hyperbolic rotations; `row` is used
/// up.
///
/// With `s = φ_i/R_ii` and `c = √((1 - s)(1 + s))`: `R ← (R - s φ)/c`, `φ ← c φ - s R`. Returns the largest
/// `|s|`, which is infinite, with the factor spoilt, where rounding leaves no information. `amplified` are
/// relative errors per parameter, which grow by `1/c²`.
///
/// Sources: Golub & Van Loan, section 6.5.4; Bojanczyk, Brent, Van Dooren & de Hoog 1987.
pub fn downdate(root: &mut SquareRoot, row: &mut [f64], amplified: &mut [f64]) -> f64 {
    let p = root.columns();
    let mut steepest = 0.0_f64;
    for i in 0..p {
        if row[i] == 0.0 {
            continue;
        }
        let own = root.row_mut(i);
        let s = row[i] / own[0];
        steepest = steepest.max(s.abs());
        let square = (1.0 - s) * (1.0 + s);
        if square.is_nan() || square <= 0.0 {
            return f64::INFINITY;
        }
        let c = libm::sqrt(square);
        own[0] *= c;
        for (r, f) in own[1..].iter_mut().zip(&mut row[i + 1..]) {
            *r = (*r - s * *f) / c;
            *f = c * *f - s * *r;
        }
        amplified[i] = (amplified[i] + f64::EPSILON) / square;
    }
    let (rss, weight) = (root.rss() - row[p] * row[p], root.weight() - 1.0);
    root.set_remainder(rss.max(0.0), weight.max(0.0));
    steepest
}

/// Window that moves sample by sample: new rows are added, those of the oldest sample removed.
///
/// Removing rows loses digits where they carried most of a parameter's information. Therefore the factor is
/// put together anew from a [`BlockWindow`] and the rows of its oldest block, once per window length, on a
/// rotation with `|s| > 1 - 1e-8`, and when the errors that rotations amplified may exceed 1e-11.
#[derive(Debug, Clone)]
pub struct RowWindow {
    length: usize,
    blocks: BlockWindow,
    root: SquareRoot,
    /// Rows of the last samples, `most` per sample, in a ring.
    ring: Vec<f64>,
    counts: Vec<usize>,
    next: usize,
    held: usize,
    amplified: Vec<f64>,
    age: usize,
    refreshes: u64,
    rows: Vec<f64>,
    most: usize,
}

impl RowWindow {
    /// Window of `blocks · block_samples` samples with up to `rows` rows each, beside a prior that always
    /// counts.
    ///
    /// Panics unless all three are positive.
    pub fn new(prior: SquareRoot, block_samples: usize, blocks: usize, rows: usize) -> Self {
        let p = prior.columns();
        let samples = block_samples * blocks;
        Self {
            length: samples,
            root: prior.clone(),
            blocks: BlockWindow::new(prior, block_samples, blocks, rows),
            ring: vec![0.0; samples * rows * (p + 1)],
            counts: vec![0; samples],
            next: 0,
            held: 0,
            amplified: vec![0.0; p],
            age: 0,
            refreshes: 0,
            rows: vec![0.0; rows * (p + 1)],
            most: rows,
        }
    }

    /// Information of the window and the prior.
    pub fn total(&self) -> &SquareRoot {
        &self.root
    }

    /// Samples that the total holds.
    pub fn samples(&self) -> usize {
        self.held
    }

    /// How often the factor was put together anew.
    pub fn refreshes(&self) -> u64 {
        self.refreshes
    }

    /// Adds a sample, weighted rows `[φ y]`, and removes the one that leaves the window.
    pub fn push(&mut self, rows: &[f64]) {
        let width = self.root.columns() + 1;
        let slot = self.next * self.most * width;
        let copy = &mut self.rows[..rows.len()];
        copy.copy_from_slice(rows);
        self.root.push(copy);
        self.blocks.push(rows);
        let leaves = if self.held == self.length { self.counts[self.next] } else { 0 };
        let mut steepest = 0.0_f64;
        for row in self.ring[slot..slot + leaves * width].chunks_exact_mut(width) {
            steepest = steepest.max(downdate(&mut self.root, row, &mut self.amplified));
        }
        self.ring[slot..slot + rows.len()].copy_from_slice(rows);
        self.counts[self.next] = rows.len() / width;
        self.next = (self.next + 1) % self.length;
        self.held = (self.held + 1).min(self.length);
        self.age += 1;
        let error = self.amplified.iter().fold(0.0_f64, |m, e| m.max(*e));
        if steepest > STEEPEST || error > LARGEST_ERROR || self.age >= self.length {
            self.refresh();
        }
    }

    fn refresh(&mut self) {
        let width = self.root.columns() + 1;
        self.root.copy_from(self.blocks.total());
        let older = self.held - self.blocks.samples();
        for k in 0..older {
            let place = (self.next + self.length - self.held + k) % self.length;
            let rows = &mut self.rows[..self.counts[place] * width];
            rows.copy_from_slice(&self.ring[place * self.most * width..][..rows.len()]);
            self.root.push(rows);
        }
        self.amplified.fill(0.0);
        self.age = 0;
        self.refreshes += 1;
    }

    pub(crate) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        self.blocks.transfer(transfer);
        self.root.transfer(transfer);
        transfer.finites(&mut self.ring);
        transfer.counts(&mut self.counts, self.most + 1);
        transfer.count(&mut self.next, self.length);
        transfer.count(&mut self.held, self.length + 1);
        transfer.finites(&mut self.amplified);
        transfer.count(&mut self.age, self.length + 1);
        transfer.counter(&mut self.refreshes);
        if self.held < self.blocks.samples() {
            transfer.fail();
        }
    }
}
