//! Which samples spoil a row.

use dynid_model::EffortModel;
use dynid_motion::mask::{near_reversal, threshold_at};
use dynid_motion::signal::rms;

use super::moving::{ReversalSpeed, moving_samples};
use super::states::States;
use super::{ConditioningSettings, PreparedLog};

/// Bad samples and their running counts, so that any window is judged by two look-ups. A count stands per word of 64 samples: one per sample
/// would take more room than the log.
#[derive(Debug, Clone)]
pub(crate) struct BadSamples {
    samples: usize,
    /// Bit `k % 64` of word `k / 64`: sample `k` is bad.
    words: Vec<u64>,
    /// Bad samples before every word.
    before: Vec<u32>,
}

impl BadSamples {
    pub(crate) fn new(bad: impl Iterator<Item = bool>) -> Self {
        let mut out = BadSamples { samples: 0, words: vec![0], before: vec![0] };
        for bad in bad {
            let last = out.words.len() - 1;
            out.words[last] |= u64::from(bad) << (out.samples % 64);
            out.samples += 1;
            if out.samples.is_multiple_of(64) {
                out.before.push(out.before[last] + out.words[last].count_ones());
                out.words.push(0);
            }
        }
        out
    }

    /// Bad samples before one.
    fn count(&self, sample: usize) -> u32 {
        let earlier = (1u64 << (sample % 64)) - 1;
        self.before[sample / 64] + (self.words[sample / 64] & earlier).count_ones()
    }

    /// True if no bad sample and no end of the record lies within `reach` of `centre`.
    pub(crate) fn clean(&self, centre: usize, reach: usize) -> bool {
        centre >= reach
            && centre + reach < self.samples
            && self.count(centre - reach) == self.count(centre + reach + 1)
    }

    /// True if no bad sample lies within `reach` of `centre`; the record's ends do not count.
    fn quiet(&self, centre: usize, reach: usize) -> bool {
        let end = (centre + reach + 1).min(self.samples);
        self.count(centre.saturating_sub(reach)) == self.count(end)
    }
}

/// For one output of one log: bad samples of the clock (all, where the joint is held), and of reversal at every rung of the ladder.
#[derive(Debug, Clone)]
pub(crate) struct Masks {
    clock: BadSamples,
    /// First entry: no reversal mask; then one per rung.
    reversal: Vec<Option<BadSamples>>,
    /// Samples in which the output moves.
    moving: usize,
}

impl Masks {
    pub(crate) fn new(
        log: &PreparedLog,
        states: &States,
        model: &dyn EffortModel,
        output: usize,
        settings: &ConditioningSettings,
    ) -> Self {
        let speeds: Vec<(Vec<f64>, f64)> =
            model.reversal_speeds(output).iter().map(|speed| states.combined(speed)).collect();
        // What does not change with the rung: the rms speed, and where the sign changes.
        let known = log.speed_rms.as_ref().map(|of_outputs| &of_outputs[output]);
        let rms_of = |k: usize, v: &[f64]| known.map_or_else(|| rms(v), |known| known[k]);
        let combinations = model.reversal_speeds(output);
        let changes: Vec<Vec<bool>> = speeds.iter().map(|(v, _)| near_reversal(v, 0.0)).collect();
        let speeds: Vec<ReversalSpeed<'_>> = combinations
            .iter()
            .zip(&speeds)
            .enumerate()
            .map(|(k, (combination, (v, sigma)))| ReversalSpeed {
                combination,
                v,
                sigma: *sigma,
                rms: rms_of(k, v),
            })
            .collect();
        let moving = if log.held[output] { 0 } else { moving_samples(log, &speeds, settings) };
        let mut reversal = vec![None];
        for level in &settings.ladder {
            let mut bad = vec![false; states.samples];
            for (speed, changes) in speeds.iter().zip(&changes) {
                let threshold = threshold_at(speed.rms, speed.sigma, settings.stick_sigma, *level);
                let threshold = threshold.max(speed.rest(log));
                for ((b, v), changes) in bad.iter_mut().zip(speed.v).zip(changes) {
                    *b |= *changes | (v.abs() < threshold);
                }
            }
            reversal.push(Some(BadSamples::new(bad.into_iter())));
        }
        let held = log.held[output];
        Masks { clock: BadSamples::new(log.usable.iter().map(|u| held || !u)), reversal, moving }
    }

    /// Samples in which the output moves.
    pub(crate) fn moving(&self) -> usize {
        self.moving
    }

    /// Number of rungs, counting "no mask".
    pub(crate) fn rungs(&self) -> usize {
        self.reversal.len()
    }

    /// Rungs (as bits) at which a row centred here with this kernel reach may be used. `outer`: reach of the state filter
    /// to edges and gaps, `inner`: to reversals, samples beyond the kernel.
    pub(crate) fn usable(&self, centre: usize, half_width: usize, outer: usize, inner: usize) -> u8 {
        if !self.clock.clean(centre, half_width + outer) {
            return 0;
        }
        let mut bits = 1;
        for (rung, bad) in self.reversal.iter().enumerate().skip(1) {
            match bad {
                Some(bad) if bad.quiet(centre, half_width + inner) => bits |= 1 << rung,
                _ => break,
            }
        }
        bits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 200 samples, clock bad at 40, reversal between 99 and 100; kernel 3, state filter 5 to edges, 3 to reversals.
    fn rows(rung: usize) -> Vec<usize> {
        let masks = Masks {
            clock: BadSamples::new((0..200).map(|n| n == 40)),
            reversal: vec![None, Some(BadSamples::new((0..200).map(|n| n == 99 || n == 100)))],
            moving: 198,
        };
        (0..200).filter(|n| masks.usable(*n, 3, 5, 3) >> rung & 1 == 1).collect()
    }

    #[test]
    fn rows_keep_their_distance_from_edges_gaps_and_reversals() {
        let without_mask: Vec<usize> = (8..32).chain(49..192).collect();
        assert_eq!(rows(0), without_mask);
        let with_mask: Vec<usize> = (8..32).chain(49..93).chain(107..192).collect();
        assert_eq!(rows(1), with_mask);
    }

    #[test]
    fn a_record_shorter_than_a_kernel_has_no_row() {
        let masks =
            Masks { clock: BadSamples::new([false; 15].into_iter()), reversal: vec![None], moving: 15 };
        assert!((0..15).all(|n| masks.usable(n, 3, 5, 3) == 0));
        assert_eq!(masks.usable(7, 3, 4, 3), 1);
    }
}
