//! Motions that repeat, within a log and from log to log.
//!
//! What a model leaves over at a place and speed comes back whenever the motion does. Rows of later periods, and of other logs of the same
//! motion, are no independent witnesses of it: precision is told by what is left over at different parts of a motion.

use dynid_motion::repetition::repeated_from;

use super::prepare::{PreparedLog, SharedMotion};

/// The motion of a log, in any unit of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogMotion {
    /// Length of the log.
    pub length: f64,
    /// Time after which its motion repeats.
    pub repeats_after: Option<f64>,
    /// The first log that holds its motion, which may be itself.
    pub first: usize,
    /// How far the log lies behind that one.
    pub lag: f64,
}

/// Finds logs that repeat the motion of an earlier one, of the same sample rate and with the same joints moving.
pub fn tell_shared_motions(logs: &mut [PreparedLog]) {
    for k in 1..logs.len() {
        let (earlier, later) = logs.split_at_mut(k);
        let log = &mut later[0];
        for (j, first) in earlier.iter_mut().enumerate() {
            let alike = (first.rate_hz / log.rate_hz - 1.0).abs() < 1e-3 && first.moves == log.moves;
            // Others of a shared motion are compared by its first log alone.
            if !alike || first.shared.is_some_and(|shared| shared.motion != j) {
                continue;
            }
            let Some(lag) = repeated_from(&first.moving(), &log.moving(), log.rate_hz) else { continue };
            first.shared = Some(SharedMotion { motion: j, lag: 0.0 });
            log.shared = Some(SharedMotion { motion: j, lag: lag as f64 });
            break;
        }
    }
}

/// The motions of logs, in samples.
pub fn motions(logs: &[PreparedLog]) -> Vec<LogMotion> {
    let same = |a: &PreparedLog, b: &PreparedLog| match (a.shared, b.shared) {
        (Some(a), Some(b)) => a.motion == b.motion,
        _ => false,
    };
    let motion = |(k, log): (usize, &PreparedLog)| {
        let first = logs[..k].iter().position(|l| same(l, log)).unwrap_or(k);
        // The log that was the first may be none of these.
        let behind = |log: &PreparedLog| log.shared.map_or(0.0, |shared| shared.lag);
        LogMotion {
            length: log.samples() as f64,
            repeats_after: log.repeats_after,
            first,
            lag: behind(log) - behind(&logs[first]),
        }
    };
    logs.iter().enumerate().map(motion).collect()
}

/// How far a period may be from a whole number of blocks, in blocks: lengths of blocks are whole samples.
const ROUNDED: f64 = 0.05;

impl LogMotion {
    /// Whether parts of the motion can be told from so many time blocks: it does not repeat, or its period is two or more whole blocks.
    pub fn has_parts(&self, blocks: usize) -> bool {
        let Some(period) = self.repeats_after else { return true };
        let (parts, count) = (self.parts(blocks).0 as f64, blocks.max(1) as f64);
        // The last block takes the rest, so that the others are shorter than the mean by up to a share of a block.
        parts >= 2.0 && parts <= period * count / self.length * (1.0 + 1.0 / count) + ROUNDED
    }

    /// Parts of the motion that so many time blocks of the log hold, and the length of one.
    ///
    /// A period is a whole number of blocks, of which the last one takes the rest of the log.
    pub fn parts(&self, blocks: usize) -> (usize, f64) {
        let mean = self.length / blocks.max(1) as f64;
        match self.repeats_after {
            Some(period) => {
                let parts = ((period / mean - ROUNDED).ceil() as usize).clamp(1, blocks.max(1));
                (parts, period / parts as f64)
            }
            None => (blocks, mean),
        }
    }
}

/// Per log and time block the part of a motion that the block holds: blocks with the same number hold the same part.
///
/// `blocks`: per log their number. Without repetition every block is a part by itself.
pub fn parts_of_motions(motions: &[LogMotion], blocks: &[usize]) -> Vec<Vec<usize>> {
    let mut begin = 0;
    let mut of_first = Vec::with_capacity(motions.len());
    for (motion, count) in motions.iter().zip(blocks) {
        let (parts, length) = motion.parts(*count);
        of_first.push((begin, parts, length));
        begin += parts;
    }
    let of_log = |(motion, count): (&LogMotion, &usize)| {
        let (begin, parts, length) = of_first[motion.first];
        let (_, block) = motion.parts(*count);
        let period = motions[motion.first].repeats_after;
        let part = |b: usize| {
            let middle = (b as f64 + 0.5) * block + motion.lag;
            let at = period.map_or(middle.max(0.0), |period| middle.rem_euclid(period));
            begin + ((at / length) as usize).min(parts.saturating_sub(1))
        };
        (0..*count).map(part).collect()
    };
    motions.iter().zip(blocks).map(of_log).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plain(length: f64, first: usize) -> LogMotion {
        LogMotion { length, repeats_after: None, first, lag: 0.0 }
    }

    #[test]
    fn blocks_of_the_same_part_have_the_same_number() {
        let once = plain(4.0, 0);
        assert_eq!(parts_of_motions(&[once], &[4]), [[0, 1, 2, 3]]);
        let twice = LogMotion { repeats_after: Some(3.0), ..plain(7.0, 0) };
        assert_eq!(parts_of_motions(&[twice], &[7]), [[0, 1, 2, 0, 1, 2, 0]]);
        // A second log begins one block later in the motion of the first, a third moves by itself.
        let again = LogMotion { lag: 1.0, ..plain(3.0, 0) };
        assert_eq!(
            parts_of_motions(&[once, again, plain(2.0, 2)], &[4, 3, 2]),
            [vec![0, 1, 2, 3], vec![1, 2, 3], vec![7, 8]]
        );
        // Lengths of blocks are whole samples: 500 of a fifth of a period of 2500.4.
        let rounded = LogMotion { repeats_after: Some(2500.4), ..plain(30_000.0, 0) };
        assert_eq!(rounded.parts(60).0, 5);
        assert_eq!(parts_of_motions(&[rounded], &[60])[0], (0..60).map(|b| b % 5).collect::<Vec<_>>());
        // The last block takes the rest.
        let rest = LogMotion { repeats_after: Some(3.0), ..plain(7.9, 0) };
        assert_eq!(parts_of_motions(&[rest], &[7]), [[0, 1, 2, 0, 1, 2, 0]]);
    }

    #[test]
    fn parts_are_told_where_a_period_is_some_whole_blocks() {
        let motion = |length: f64, period: f64| LogMotion { repeats_after: Some(period), ..plain(length, 0) };
        assert!(plain(9.0, 0).has_parts(9));
        assert!(motion(30_000.0, 2500.4).has_parts(60) && motion(7.9, 3.0).has_parts(7));
        // A period within one block, and one that is two blocks and a half.
        assert!(!motion(60.0, 0.9).has_parts(60));
        assert!(!motion(60.0, 2.5).has_parts(60));
    }
}
