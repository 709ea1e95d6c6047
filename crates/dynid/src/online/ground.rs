//! Whether rows lie where something was learned.

use dynid_estimate::online::{Innovation, Watch};
use dynid_words::Transfer;

use super::usual::Innovations;

/// Variance of a prediction by what is not known of the parameters, in parts of that of the noise, from which on a row leaves the region that was
/// learned.
const OUTSIDE: f64 = 0.1;
/// Alarms are first given after so many times the rows for which they are withheld otherwise.
const FIRST: u64 = 2;
/// Fewest innovations of a block that say anything of their size.
const FEWEST: u64 = 8;

/// Where the motion of a stream goes, against where it has been.
///
/// A stretch that was learned from need not cover the motion to come, and no model is right everywhere: errors grow where it was never fitted, though
/// nothing has changed. While rows leave the region that was learned, and for some time after the last one, alarms are withheld; the estimate goes
/// on, and so does learning what errors are usual.
#[derive(Debug)]
pub(super) struct Ground {
    /// Samples of rows until alarms are given again; 0: they are.
    left: u64,
    /// Samples of rows for which they are withheld after the last row outside.
    settling: u64,
    /// Samples of rows of a block of innovations.
    length: u64,
    /// Per output: sum of squares of a block's whitened innovations, and their number.
    block: Vec<(f64, u64)>,
    taken: u64,
    /// Per output: column of the regressor that holds its joint's speed, if one does.
    speeds: Vec<Option<usize>>,
    /// Per output: samples of rows at speeds of every bin.
    visits: Vec<Vec<u64>>,
}

impl Ground {
    /// `settling` and `length` in samples of rows.
    pub(super) fn new(speeds: Vec<Option<usize>>, settling: u64, length: u64) -> Ground {
        let outputs = speeds.len();
        // What was learned is first judged by rows that it has not seen.
        Ground {
            left: FIRST * settling,
            settling,
            length: length.max(1),
            block: vec![(0.0, 0); outputs],
            taken: 0,
            visits: vec![vec![0; 2 * BINS]; outputs],
            speeds,
        }
    }

    /// Whether alarms are given.
    pub(super) fn is_known(&self) -> bool {
        self.left == 0
    }

    /// Counts the speeds of a sample; whether one of them is new: friction that is not quite what the model says shows at speeds that were never
    /// fitted, however well its parameters are known.
    pub(super) fn visit(&mut self, used: &[usize], regressor: &[f64]) -> bool {
        let width = regressor.len() / used.len().max(1);
        let mut is_new = false;
        for (row, output) in used.iter().enumerate() {
            let Some(column) = self.speeds[*output] else { continue };
            let visits = &mut self.visits[*output][bin(regressor[row * width + column])];
            is_new |= *visits < self.length;
            *visits += 1;
        }
        is_new
    }

    /// Takes what a row asks of the estimate; whether it may raise an alarm. `inflation`: by how much information is overstated;
    /// `is_new`: its speeds are.
    pub(super) fn watches(&mut self, innovation: &Innovation, inflation: f64, is_new: bool) -> Watch {
        if innovation.leverage() * inflation > OUTSIDE {
            self.left = self.settling.max(1);
        } else {
            self.left = self.left.saturating_sub(1);
        }
        match self.left {
            0 if is_new => Watch::Pass,
            0 => Watch::Count,
            _ => Watch::Restart,
        }
    }

    /// Learns the size of innovations while alarms are withheld: that of the worst block.
    pub(super) fn learn(&mut self, used: &[usize], whitened: &[f64], usual: &mut Innovations) {
        if self.left == 0 {
            self.begin();
            return;
        }
        for (output, u) in used.iter().zip(whitened) {
            let (sum, count) = &mut self.block[*output];
            (*sum, *count) = (*sum + u * u, *count + 1);
        }
        self.taken += 1;
        if self.taken >= self.length {
            for ((sum, count), size) in self.block.iter().zip(&mut usual.size) {
                if *count >= FEWEST {
                    // Innovations come in units of the size known so far.
                    *size *= (sum / *count as f64).max(1.0);
                }
            }
            self.begin();
        }
    }

    fn begin(&mut self) {
        self.block.fill((0.0, 0));
        self.taken = 0;
    }

    /// Carries the state to or from a checkpoint.
    pub(super) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.integer(&mut self.left);
        transfer.integer(&mut self.taken);
        for (sum, count) in &mut self.block {
            transfer.real(sum);
            transfer.integer(count);
        }
        self.visits.iter_mut().flatten().for_each(|count| transfer.integer(count));
    }
}

/// Bins of speeds per direction, half an octave each.
const BINS: usize = 32;
/// Speeds below this are one, rad/s or m/s.
const SLOWEST: f64 = 1e-3;

/// Bin of a speed; those next to rest are one.
fn bin(speed: f64) -> usize {
    let octaves = 2.0 * (speed.abs() / SLOWEST).max(1.0).log2();
    let size = (octaves as usize).min(BINS - 1);
    if speed < 0.0 { BINS + size } else { size }
}
