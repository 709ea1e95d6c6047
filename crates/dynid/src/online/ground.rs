//! Whether rows lie where something was learned.

use dynid_estimate::online::{Innovation, Watch};
use dynid_words::Transfer;

use super::usual::{EXTENTS, Innovations};

/// Variance of a prediction by what is not known of the parameters, in parts of that of the noise, from which on a row leaves the region that was
/// learned.
const OUTSIDE: f64 = 0.1;
/// Alarms are first given after so many times the rows for which they are withheld otherwise.
const FIRST: u64 = 2;

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
    outputs: Vec<Place>,
}

/// Where the motion of an output has been.
#[derive(Debug)]
struct Place {
    /// Column of the regressor that holds its joint's speed, if one does.
    speed: Option<usize>,
    /// Samples of rows at speeds of every bin.
    visits: Vec<u64>,
    /// Per column of the regressor: largest magnitude in the stretch that was learned from, or what cannot be told from noise.
    learned: Vec<f64>,
    /// How far the newest row goes.
    extent: usize,
    /// Whether few rows went as far.
    is_new: bool,
    /// By extent: samples of rows that went as far.
    rows: [u64; EXTENTS],
    /// By extent: sum of squares of a block's innovations, and their number.
    blocks: [(f64, u64); EXTENTS],
}

impl Ground {
    /// Per output the column that holds its joint's speed, and magnitudes of its columns, above zero, that cannot be told from noise; `settling` and
    /// `length` in samples of rows.
    pub(super) fn new(outputs: Vec<(Option<usize>, Vec<f64>)>, settling: u64, length: u64) -> Ground {
        let place = |(speed, learned)| Place {
            speed,
            visits: vec![0; 2 * BINS],
            learned,
            extent: 0,
            is_new: false,
            rows: [0; EXTENTS],
            blocks: [(0.0, 0); EXTENTS],
        };
        // What was learned is first judged by rows that it has not seen.
        Ground {
            left: FIRST * settling,
            settling,
            length: length.max(1),
            outputs: outputs.into_iter().map(place).collect(),
        }
    }

    /// Takes a sample of the stretch that is learned from.
    pub(super) fn learn_from(&mut self, used: &[usize], regressor: &[f64]) {
        for (output, columns) in rows_of(used, regressor) {
            let place = &mut self.outputs[output];
            place.visit_speed(columns);
            place.learned.iter_mut().zip(columns).for_each(|(known, x)| *known = known.max(x.abs()));
        }
    }

    /// Finds how far the rows of a sample go.
    pub(super) fn enter(&mut self, used: &[usize], regressor: &[f64]) {
        for (output, columns) in rows_of(used, regressor) {
            let place = &mut self.outputs[output];
            let extents = place.learned.iter().zip(columns).map(|(known, x)| extent(x.abs(), *known));
            place.extent = extents.max().unwrap_or(0);
        }
    }

    /// How far the newest row of an output goes.
    pub(super) fn extent(&self, output: usize) -> usize {
        self.outputs[output].extent
    }

    /// Whether alarms are given.
    pub(super) fn is_known(&self) -> bool {
        self.left == 0
    }

    /// Counts where the rows of a sample are; whether few were there before. Friction that is not quite what the model says shows at speeds that were
    /// never fitted, however well its parameters are known, and errors of positions that are filtered and differentiated grow with the motion.
    pub(super) fn visit(&mut self, used: &[usize], regressor: &[f64]) -> bool {
        let enough = self.length;
        let mut is_new = false;
        for (output, columns) in rows_of(used, regressor) {
            let place = &mut self.outputs[output];
            let rows = &mut place.rows[place.extent];
            place.is_new = place.extent > 0 && *rows < enough;
            *rows += 1;
            place.is_new |= place.visit_speed(columns) < enough;
            is_new |= place.is_new;
        }
        is_new
    }

    /// Takes what a row asks of the estimate; whether it may raise an alarm. `inflation`: by how much information is overstated;
    /// `is_new`: few rows were where it is ([`Ground::visit`]).
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

    /// Learns the size of innovations, that of the worst block, from rows that go further than others or for which alarms are withheld.
    ///
    /// A block holds few independent innovations: the upper end of its interval counts, since too large a size only delays alarms.
    pub(super) fn learn(&mut self, used: &[usize], whitened: &[f64], usual: &mut Innovations) {
        for (output, u) in used.iter().zip(whitened) {
            let place = &mut self.outputs[*output];
            if self.left == 0 && !place.is_new {
                continue;
            }
            // Innovations come in units of the size known so far.
            let (sum, count) = &mut place.blocks[place.extent];
            (*sum, *count) = (*sum + u * u, *count + 1);
            if *count >= self.length {
                // Two standard errors of a mean square, as coloured as innovations were.
                let margin = 1.0 + 2.0 * (2.0 * usual.inflation / *count as f64).sqrt();
                usual.grow(*output, place.extent, margin * *sum / *count as f64);
                (*sum, *count) = (0.0, 0);
            }
        }
    }

    /// Carries the state to or from a checkpoint.
    pub(super) fn transfer(&mut self, transfer: &mut Transfer<'_>) {
        transfer.integer(&mut self.left);
        for place in &mut self.outputs {
            let Place { speed: _, visits, learned, extent, is_new, rows, blocks } = place;
            visits.iter_mut().chain(rows).for_each(|count| transfer.integer(count));
            learned.iter_mut().for_each(|x| transfer.real(x));
            transfer.count(extent, EXTENTS - 1);
            transfer.flag(is_new);
            for (sum, count) in blocks {
                transfer.real(sum);
                transfer.integer(count);
            }
        }
    }
}

impl Place {
    /// Counts a speed; how many rows had it before.
    fn visit_speed(&mut self, columns: &[f64]) -> u64 {
        let Some(column) = self.speed else { return u64::MAX };
        let visits = &mut self.visits[bin(columns[column])];
        *visits += 1;
        *visits - 1
    }
}

/// How far a magnitude lies beyond the largest that is known, in half octaves that have begun.
fn extent(size: f64, known: f64) -> usize {
    if size > known { 1 + (2.0 * (size / known).log2()).min((EXTENTS - 2) as f64) as usize } else { 0 }
}

/// Outputs of a sample and their rows of the regressor.
fn rows_of<'a>(used: &'a [usize], regressor: &'a [f64]) -> impl Iterator<Item = (usize, &'a [f64])> {
    let width = regressor.len() / used.len().max(1);
    used.iter().copied().zip(regressor.chunks_exact(width.max(1)))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_beyond_the_motion_that_was_learned_are_new_until_enough_were_there() {
        let mut ground = Ground::new(vec![(None, vec![1e-3; 2]), (None, vec![1e-3; 2])], 1, 3);
        ground.learn_from(&[0, 1], &[1.0, -2.0, 0.0, 0.5]);
        let mut visit = |used: &[usize], regressor: &[f64]| {
            ground.enter(used, regressor);
            (ground.visit(used, regressor), ground.extent(used[0]))
        };
        assert_eq!(visit(&[0, 1], &[-1.0, 2.0, 0.0, -0.5]), (false, 0), "no column is larger than before");
        let far = [0; 5].map(|_| visit(&[0], &[0.0, -4.0]));
        assert_eq!(far, [(true, 3), (true, 3), (true, 3), (false, 3), (false, 3)]);
        assert_eq!(visit(&[0], &[0.0, 40.0]), (true, 9), "further");
        assert_eq!(visit(&[1], &[0.0, 1.0]), (true, 3), "the other output");
        assert_eq!(visit(&[1], &[1e-9, 0.5]), (false, 0), "no more than noise");
        assert_eq!(visit(&[1], &[1e9, 0.5]), (true, EXTENTS - 1), "no end");
    }

    #[test]
    fn rows_that_raise_no_alarm_teach_what_is_usual_where_they_are() {
        let mut usual = Innovations::stated(1);
        let mut ground = Ground::new(vec![(None, vec![1e-3])], 0, 8);
        ground.learn_from(&[0], &[1.0]);
        let mut row = |x: f64, u: f64| {
            ground.enter(&[0], &[x]);
            ground.visit(&[0], &[x]);
            ground.learn(&[0], &[u], &mut usual);
        };
        (0..8).for_each(|_| row(0.5, 30.0));
        (0..8).for_each(|_| row(3.0, 3.0));
        (0..8).for_each(|_| row(3.0, 30.0));
        assert_eq!(
            [0, 3, 4, 5, EXTENTS - 1].map(|extent| usual.size(0, extent)),
            [1.0, 1.0, 18.0, 18.0, 18.0]
        );
    }
}
