//! Whether rows lie where something was learned.

use dynid_estimate::online::Innovation;
use dynid_motion::words::Transfer;

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
}

impl Ground {
    /// `settling` and `length` in samples of rows.
    pub(super) fn new(outputs: usize, settling: u64, length: u64) -> Ground {
        // What was learned is first judged by rows that it has not seen.
        Ground {
            left: FIRST * settling,
            settling,
            length: length.max(1),
            block: vec![(0.0, 0); outputs],
            taken: 0,
        }
    }

    /// Whether alarms are given.
    pub(super) fn is_known(&self) -> bool {
        self.left == 0
    }

    /// Takes what a row asks of the estimate; whether it may raise an alarm. `inflation`: by how much information is overstated.
    pub(super) fn watches(&mut self, innovation: &Innovation, inflation: f64) -> bool {
        if innovation.leverage() * inflation > OUTSIDE {
            self.left = self.settling.max(1);
        } else {
            self.left = self.left.saturating_sub(1);
        }
        self.left == 0
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
    }
}
