//! States of a log at the state cut-off, and which samples spoil a row.

use dynid_model::{EffortModel, History, MotionBlock};
use dynid_motion::Channel;
use dynid_motion::difference::central;
use dynid_motion::filter::{Sections, butterworth, forward_backward};
use dynid_motion::mask::{near_reversal, reversal_threshold};
use dynid_motion::spectrum::velocity_noise;
use rayon::prelude::*;

use super::{ConditioningError, ConditioningSettings, Moving, PreparedLog};

/// Filtered positions, their derivatives, and efforts through the same filter.
#[derive(Debug, Clone)]
pub struct States {
    /// Number of samples.
    pub samples: usize,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Cut-off of the state filter, Hz.
    pub cutoff_hz: f64,
    /// Positions, output after output.
    pub q: Vec<f64>,
    /// Velocities.
    pub dq: Vec<f64>,
    /// Accelerations.
    pub ddq: Vec<f64>,
    /// Per output: effort through the state filter; empty where no effort was asked for.
    pub effort: Vec<Vec<f64>>,
    /// Per output: standard deviation of the velocity that comes from position noise.
    pub velocity_sigma: Vec<f64>,
}

impl States {
    /// States of a prepared log: zero-phase Butterworth at `cutoff_hz`, central differences. Those of a periodic log are the
    /// exact ones of its series; efforts pass the filter either way.
    pub fn new(
        log: &PreparedLog,
        cutoff_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        States::build(log, cutoff_hz, settings, true)
    }

    fn build(
        log: &PreparedLog,
        cutoff_hz: f64,
        settings: &ConditioningSettings,
        with_effort: bool,
    ) -> Result<States, ConditioningError> {
        let filter = butterworth(settings.state_order, cutoff_hz, log.rate_hz)?;
        let samples = log.samples();
        let [mut q, mut dq, mut ddq] = [(); 3].map(|()| vec![0.0; samples * log.position.len()]);
        // Every joint writes to its place: long logs leave no room for a second copy.
        let places = q
            .par_chunks_exact_mut(samples.max(1))
            .zip(dq.par_chunks_exact_mut(samples.max(1)))
            .zip(ddq.par_chunks_exact_mut(samples.max(1)));
        let per_joint = places
            .enumerate()
            .map(|(j, ((q, dq), ddq))| {
                let effort = match with_effort {
                    true => forward_backward(&filter, &log.effort[j])?,
                    false => Vec::new(),
                };
                if let Some(motion) = &log.periodic {
                    q.copy_from_slice(&motion.q[j]);
                    dq.copy_from_slice(&motion.dq[j]);
                    ddq.copy_from_slice(&motion.ddq[j]);
                    return Ok((effort, motion.velocity_sigma[j]));
                }
                for (place, signal) in
                    [q, dq, ddq].into_iter().zip(motion(&filter, &log.position[j], log.rate_hz)?)
                {
                    place.copy_from_slice(&signal);
                }
                let floor = log.position_noise[j].floor_psd;
                let sigma = velocity_noise(floor, settings.state_order, cutoff_hz, log.rate_hz)?;
                Ok((effort, sigma))
            })
            .collect::<Result<Vec<_>, ConditioningError>>()?;
        let (effort, velocity_sigma) = per_joint.into_iter().unzip();
        Ok(States { samples, rate_hz: log.rate_hz, cutoff_hz, q, dq, ddq, effort, velocity_sigma })
    }

    /// States at a cut-off that counts up to what the sample rate of the log allows.
    ///
    /// # Errors
    /// Fails as [`States::new`] does.
    pub fn of(
        log: &PreparedLog,
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        States::new(log, state_hz.min(settings.cutoff.state_rate * log.rate_hz), settings)
    }

    /// States at a cut-off that counts up to what the sample rate of the log allows, without efforts.
    ///
    /// # Errors
    /// As [`States::new`].
    pub fn of_motion(
        log: &PreparedLog,
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        States::build(log, state_hz.min(settings.cutoff.state_rate * log.rate_hz), settings, false)
    }

    /// States of another motion on the same grid: through the same filter, differentiated alike. They have no effort and no
    /// noise. Of a periodic log the filter at the state cut-off stands in for its series.
    ///
    /// `position`: per output, as many samples as this record has.
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for a position that is not finite.
    ///
    /// # Panics
    /// Unless there are as many outputs and samples.
    pub fn along(
        &self,
        position: &[Vec<f64>],
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        assert_eq!(position.len(), self.effort.len(), "one motion per output");
        let filter = butterworth(settings.state_order, self.cutoff_hz, self.rate_hz)?;
        let moved = position.par_iter().map(|position| {
            assert_eq!(position.len(), self.samples, "the motion is on the grid of the log");
            motion(&filter, position, self.rate_hz)
        });
        let moved = moved.collect::<Result<Vec<_>, _>>()?;
        let all = |k: usize| moved.iter().flat_map(|m| m[k].iter().copied()).collect();
        Ok(States {
            q: all(0),
            dq: all(1),
            ddq: all(2),
            effort: Vec::new(),
            velocity_sigma: vec![0.0; position.len()],
            ..*self
        })
    }

    /// Sets velocities of joints that stand to zero: their sign there is that of noise, and friction may have any value up to static friction. A
    /// prediction along such states is the middle of what it may be, and does not jump.
    pub fn rest(&mut self, moving: &Moving) {
        for (velocity, moves) in self.dq.chunks_exact_mut(self.samples.max(1)).zip(&moving.samples) {
            for (v, _) in velocity.iter_mut().zip(moves).filter(|(_, moves)| !**moves) {
                *v = 0.0;
            }
        }
    }

    /// Velocity of an output.
    pub fn velocity(&self, output: usize) -> &[f64] {
        &self.dq[output * self.samples..][..self.samples]
    }

    /// Signals of a model that depend on the motion before, over the whole record. `channels`: whole channels of the log.
    pub fn remembered(&self, model: &dyn EffortModel, shape: &[f64], channels: &[Channel]) -> Vec<Channel> {
        let (names, n) = (model.signals(), self.samples);
        if names.is_empty() || n == 0 {
            return Vec::new();
        }
        let mut values = vec![0.0; names.len() * n];
        self.with_block(0..n, channels, &[], |motion| {
            model.remember(motion, 1.0 / self.rate_hz, shape, &mut History::default(), n, &mut values);
        });
        let signals = names.iter().zip(values.chunks_exact(n));
        signals.map(|(name, values)| Channel { name: name.clone(), values: values.to_vec() }).collect()
    }

    /// A run of samples as a motion block. `channels`: whole channels of the log; `remembered`: signals of the model over the
    /// whole record ([`States::remembered`]).
    pub fn with_block<T>(
        &self,
        range: std::ops::Range<usize>,
        channels: &[Channel],
        remembered: &[Channel],
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let channels: Vec<(&str, &[f64])> =
            channels.iter().chain(remembered).map(|c| (c.name.as_str(), &c.values[range.clone()])).collect();
        work(&MotionBlock {
            samples: range.len(),
            stride: self.samples,
            q: &self.q[range.start..],
            dq: &self.dq[range.start..],
            ddq: &self.ddq[range.start..],
            gravity: None,
            channels: &channels,
            sign_width: 0.0,
        })
    }

    /// Least speed of every reversal speed of an output at a level of the mask, `max(stick_sigma σ_v, level rms(v))`
    /// ([`reversal_threshold`]).
    pub fn reversal_thresholds(
        &self,
        model: &dyn EffortModel,
        output: usize,
        level: f64,
        stick_sigma: f64,
    ) -> Vec<f64> {
        let speeds = model.reversal_speeds(output);
        let threshold = |speed: &Vec<(usize, f64)>| {
            let (v, sigma) = self.combined(speed);
            reversal_threshold(&v, sigma, stick_sigma, level)
        };
        speeds.iter().map(threshold).collect()
    }

    /// A combination of rates and the standard deviation of its noise.
    fn combined(&self, speed: &[(usize, f64)]) -> (Vec<f64>, f64) {
        let mut v = vec![0.0; self.samples];
        let mut variance = 0.0;
        for (rate, factor) in speed {
            for (v, x) in v.iter_mut().zip(self.velocity(*rate)) {
                *v += factor * x;
            }
            variance += (factor * self.velocity_sigma[*rate]).powi(2);
        }
        (v, variance.sqrt())
    }
}

/// Filtered position, velocity and acceleration.
fn motion(filter: &Sections, position: &[f64], rate_hz: f64) -> Result<[Vec<f64>; 3], ConditioningError> {
    let q = forward_backward(filter, position)?;
    let dq = central(&q, rate_hz)?;
    let ddq = central(&dq, rate_hz)?;
    Ok([q, dq, ddq])
}

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

/// For one output of one log: bad samples of the clock, and of reversal at every rung of the ladder.
#[derive(Debug, Clone)]
pub(crate) struct Masks {
    clock: BadSamples,
    /// First entry: no reversal mask; then one per rung.
    reversal: Vec<Option<BadSamples>>,
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
        let mut reversal = vec![None];
        for level in &settings.ladder {
            let mut bad = vec![false; states.samples];
            for (v, sigma) in &speeds {
                let threshold = reversal_threshold(v, *sigma, settings.stick_sigma, *level);
                for (b, n) in bad.iter_mut().zip(near_reversal(v, threshold)) {
                    *b |= n;
                }
            }
            reversal.push(Some(BadSamples::new(bad.into_iter())));
        }
        Masks { clock: BadSamples::new(log.usable.iter().map(|u| !u)), reversal }
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
        let masks = Masks { clock: BadSamples::new([false; 15].into_iter()), reversal: vec![None] };
        assert!((0..15).all(|n| masks.usable(n, 3, 5, 3) == 0));
        assert_eq!(masks.usable(7, 3, 4, 3), 1);
    }
}
