//! States of a log at the state cut-off, and which samples spoil a row.

use std::ops::Range;

use dynid_model::{EffortModel, History, MotionBlock};
use dynid_motion::difference::central_part;
use dynid_motion::filter::{Sections, butterworth, forward_backward_all};
use dynid_motion::mask::{near_reversal, reversal_threshold, threshold_at};
use dynid_motion::signal::rms;
use dynid_motion::spectrum::{PositionNoise, velocity_noise};
use dynid_motion::{Channel, SignalError};
use rayon::prelude::*;

use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// Filtered positions and efforts of a log; velocities and accelerations are formed where they are asked for.
///
/// A long log leaves no room for its derivatives: they would take twice that of its positions, and forming them anew costs little
/// beside whatever reads them.
#[derive(Debug, Clone)]
pub struct States {
    /// Number of samples.
    pub samples: usize,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Cut-off of the state filter, Hz.
    pub cutoff_hz: f64,
    /// Per output: positions.
    q: Vec<Vec<f64>>,
    /// Per output: velocities and accelerations where they are those of a series or polynomials, not central differences.
    rates: Option<[Vec<Vec<f64>>; 2]>,
    /// Per output and sample: the joint moves. Elsewhere its velocity is zero.
    pub(super) moves: Option<Vec<Vec<bool>>>,
    /// Per output: effort through the state filter; empty where no effort was asked for.
    pub effort: Vec<Vec<f64>>,
    /// Per output: standard deviation of the velocity that comes from position noise.
    pub velocity_sigma: Vec<f64>,
}

/// Motion of consecutive samples, output after output.
#[derive(Debug, Clone, PartialEq)]
pub struct StateBlock {
    /// Positions.
    pub q: Vec<f64>,
    /// Velocities.
    pub dq: Vec<f64>,
    /// Accelerations.
    pub ddq: Vec<f64>,
}

impl States {
    /// States of a prepared log: zero-phase Butterworth at `cutoff_hz`, central differences. Those of a periodic log are the
    /// exact ones of its series; efforts pass the filter either way. The textbook route may smooth otherwise
    /// ([`ConditioningSettings::smoothing`]).
    pub fn new(
        log: &PreparedLog,
        cutoff_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        let mut out = States::of_motion_at(log, cutoff_hz, settings)?;
        let filter = butterworth(settings.state_order, cutoff_hz, log.rate_hz)?;
        let effort: Vec<&[f64]> = log.effort.iter().map(|effort| effort.as_slice()).collect();
        out.effort = filtered(&filter, &effort)?;
        Ok(out)
    }

    /// [`States::new`] without efforts.
    pub(super) fn of_motion_at(
        log: &PreparedLog,
        cutoff_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<States, ConditioningError> {
        let smooth = settings.smoothing.motion(log, cutoff_hz)?;
        let (q, velocity_sigma, rates) = match (smooth, &log.periodic) {
            (Some(motion), _) => (motion.q, motion.velocity_sigma, motion.rates),
            (None, Some(motion)) => {
                let rates = [motion.dq.clone(), motion.ddq.clone()];
                (motion.q.clone(), motion.velocity_sigma.clone(), Some(rates))
            }
            (None, None) => {
                let filter = butterworth(settings.state_order, cutoff_hz, log.rate_hz)?;
                let sigma = |noise: &PositionNoise| {
                    velocity_noise(noise.floor_psd, settings.state_order, cutoff_hz, log.rate_hz)
                };
                let sigma = log.position_noise.iter().map(sigma).collect::<Result<_, _>>()?;
                (positions(&filter, &log.position, log.rate_hz)?, sigma, None)
            }
        };
        Ok(States {
            samples: log.samples(),
            rate_hz: log.rate_hz,
            cutoff_hz,
            q,
            rates,
            moves: None,
            effort: Vec::new(),
            velocity_sigma,
        })
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
        States::of_motion_at(log, state_hz.min(settings.cutoff.state_rate * log.rate_hz), settings)
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
        assert_eq!(position.len(), self.q.len(), "one motion per output");
        for position in position {
            assert_eq!(position.len(), self.samples, "the motion is on the grid of the log");
        }
        let (q, rates) = match settings.smoothing.along(position, self.rate_hz)? {
            Some(motion) => (motion.q, motion.rates),
            None => {
                let filter = butterworth(settings.state_order, self.cutoff_hz, self.rate_hz)?;
                (positions(&filter, position, self.rate_hz)?, None)
            }
        };
        Ok(States {
            q,
            rates,
            moves: None,
            effort: Vec::new(),
            velocity_sigma: vec![0.0; position.len()],
            ..*self
        })
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.q.len()
    }

    /// Position of an output.
    pub fn position(&self, output: usize) -> &[f64] {
        &self.q[output]
    }

    /// Velocity of an output.
    pub fn velocity(&self, output: usize) -> Vec<f64> {
        self.velocity_in(output, 0..self.samples)
    }

    /// Velocity of an output in a run of samples.
    pub fn velocity_in(&self, output: usize, range: Range<usize>) -> Vec<f64> {
        let mut out = vec![0.0; range.len()];
        self.fill_velocity(output, range, &mut out);
        out
    }

    /// Acceleration of an output.
    pub fn acceleration(&self, output: usize) -> Vec<f64> {
        let mut out = vec![0.0; self.samples];
        self.fill_rates(output, 0..self.samples, &mut vec![0.0; self.samples], &mut out);
        out
    }

    fn fill_velocity(&self, output: usize, range: Range<usize>, out: &mut [f64]) {
        match &self.rates {
            Some([dq, _]) => out.copy_from_slice(&dq[output][range.clone()]),
            None => central_part(&self.q[output], self.rate_hz, range.clone(), out),
        }
        self.rest(output, range, out);
    }

    /// Takes the velocity away where the joint stands.
    fn rest(&self, output: usize, range: Range<usize>, velocity: &mut [f64]) {
        if let Some(moves) = &self.moves {
            for (v, _) in velocity.iter_mut().zip(&moves[output][range]).filter(|(_, moves)| !**moves) {
                *v = 0.0;
            }
        }
    }

    /// Velocity and acceleration of a run of samples.
    fn fill_rates(&self, output: usize, range: Range<usize>, dq: &mut [f64], ddq: &mut [f64]) {
        if let Some([_, exact]) = &self.rates {
            self.fill_velocity(output, range.clone(), dq);
            ddq.copy_from_slice(&exact[output][range]);
            return;
        }
        // Velocities one sample further on either side; at the ends of the record there is none, and the difference is one-sided.
        let wide = range.start.saturating_sub(1)..(range.end + 1).min(self.samples);
        let mut velocity = vec![0.0; wide.len()];
        central_part(&self.q[output], self.rate_hz, wide.clone(), &mut velocity);
        let inside = range.start - wide.start..range.end - wide.start;
        dq.copy_from_slice(&velocity[inside.clone()]);
        central_part(&velocity, self.rate_hz, inside, ddq);
        self.rest(output, range, dq);
    }

    /// Motion of a run of samples.
    pub fn block(&self, range: Range<usize>) -> StateBlock {
        let length = self.q.len() * range.len();
        let mut block =
            StateBlock { q: Vec::with_capacity(length), dq: vec![0.0; length], ddq: vec![0.0; length] };
        let places =
            block.dq.chunks_exact_mut(range.len().max(1)).zip(block.ddq.chunks_exact_mut(range.len().max(1)));
        for (output, (dq, ddq)) in places.enumerate() {
            block.q.extend(&self.q[output][range.clone()]);
            self.fill_rates(output, range.clone(), dq, ddq);
        }
        block
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
        range: Range<usize>,
        channels: &[Channel],
        remembered: &[Channel],
        work: impl FnOnce(&MotionBlock<'_>) -> T,
    ) -> T {
        let channels: Vec<(&str, &[f64])> =
            channels.iter().chain(remembered).map(|c| (c.name.as_str(), &c.values[range.clone()])).collect();
        let block = self.block(range.clone());
        let motion = MotionBlock::plain(range.len(), &block.q, &block.dq, &block.ddq);
        work(&MotionBlock { channels: &channels, ..motion })
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
    pub(super) fn combined(&self, speed: &[(usize, f64)]) -> (Vec<f64>, f64) {
        let mut v = vec![0.0; self.samples];
        let mut variance = 0.0;
        for (rate, factor) in speed {
            for (v, x) in v.iter_mut().zip(&self.velocity(*rate)) {
                *v += factor * x;
            }
            variance += (factor * self.velocity_sigma[*rate]).powi(2);
        }
        (v, variance.sqrt())
    }
}

/// Positions through a filter, of which two derivatives can be formed.
fn positions(
    filter: &Sections,
    position: &[Vec<f64>],
    rate_hz: f64,
) -> Result<Vec<Vec<f64>>, ConditioningError> {
    let position: Vec<&[f64]> = position.iter().map(Vec::as_slice).collect();
    let filtered = filtered(filter, &position)?;
    filtered.par_iter().try_for_each(|q| {
        let mut largest = q.windows(2).map(|w| (w[1] - w[0]) * rate_hz * rate_hz).enumerate();
        match largest.find(|(_, acceleration)| !acceleration.is_finite()) {
            Some((sample, found)) => Err(SignalError::NotFinite { sample, found }),
            None => Ok(()),
        }
    })?;
    Ok(filtered)
}

/// Signals that are filtered by one thread: as many as the filter takes in the time of one.
const IN_STEP: usize = 4;

/// Signals of one length through a filter, forward and backward.
fn filtered(filter: &Sections, signals: &[&[f64]]) -> Result<Vec<Vec<f64>>, SignalError> {
    let groups = signals.par_chunks(IN_STEP).map(|signals| forward_backward_all(filter, signals));
    Ok(groups.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
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

/// Least speed of a joint that moves, as a share of its rms speed: the first rung of the usual ladder of reversal masks.
pub(super) const LEAST_SHARE: f64 = 0.03;
/// Speed, rad/s or m/s, up to which a joint stands however quiet its encoder: the filter of a constant position leaves its rounding.
const ROUNDING: f64 = 1e-9;

/// For one output of one log: bad samples of the clock, and of reversal at every rung of the ladder.
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
        let speeds: Vec<(&Vec<f64>, f64, f64, Vec<bool>)> = speeds
            .iter()
            .enumerate()
            .map(|(k, (v, sigma))| (v, *sigma, rms_of(k, v), near_reversal(v, 0.0)))
            .collect();
        let moves = |n: usize| {
            speeds.iter().all(|(v, sigma, rms, _)| {
                v[n].abs() >= threshold_at(*rms, *sigma, settings.stick_sigma, LEAST_SHARE).max(ROUNDING)
            })
        };
        let moving = (0..states.samples).filter(|n| moves(*n)).count();
        let mut reversal = vec![None];
        for level in &settings.ladder {
            let mut bad = vec![false; states.samples];
            for (v, sigma, rms, changes) in &speeds {
                let threshold = threshold_at(*rms, *sigma, settings.stick_sigma, *level).max(ROUNDING);
                for ((b, v), changes) in bad.iter_mut().zip(*v).zip(changes) {
                    *b |= *changes | (v.abs() < threshold);
                }
            }
            reversal.push(Some(BadSamples::new(bad.into_iter())));
        }
        Masks { clock: BadSamples::new(log.usable.iter().map(|u| !u)), reversal, moving }
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
