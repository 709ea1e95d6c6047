//! States of a log at the state cut-off.

use std::ops::Range;

use dynid_model::{EffortModel, History, MotionBlock};
use dynid_motion::difference::central_part;
use dynid_motion::filter::{Sections, butterworth, forward_backward_all};
use dynid_motion::mask::reversal_threshold;
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
    /// What was before.
    pub(super) recall: Recall,
    /// All motion, where it is held for rows that are formed over and over.
    held: Option<StateBlock>,
}

/// What elements remember of an earlier record before a sample of this one; by default the start of a record.
#[derive(Debug, Clone, Default)]
pub struct Recall {
    /// The sample.
    pub sample: usize,
    /// What they remember before it.
    pub history: History,
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
            recall: Recall::default(),
            held: None,
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
            recall: self.recall.clone(),
            held: None,
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

    /// Holds all motion from now on, which takes three times the memory of the positions.
    pub(super) fn hold(&mut self) {
        self.held = Some(self.block(0..self.samples));
    }

    /// Signals of a model that depend on the motion before, over the whole record, from where it recalls what was before; zeros earlier.
    /// `channels`: whole channels of the log.
    pub fn remembered(&self, model: &dyn EffortModel, shape: &[f64], channels: &[Channel]) -> Vec<Channel> {
        let (names, n, from) = (model.signals(), self.samples, self.recall.sample);
        if names.is_empty() || n <= from {
            return Vec::new();
        }
        let mut values = vec![0.0; names.len() * n];
        self.with_block(from..n, channels, &[], |motion| {
            let mut history = self.recall.history.clone();
            model.remember(motion, 1.0 / self.rate_hz, shape, &mut history, n, &mut values[from..]);
        });
        let signals = names.iter().zip(values.chunks_exact(n));
        signals.map(|(name, values)| Channel { name: name.clone(), values: values.to_vec() }).collect()
    }

    /// What elements remember before a sample that is not before the one that this record recalls.
    pub(super) fn history_at(
        &self,
        sample: usize,
        model: &dyn EffortModel,
        shape: &[f64],
        channels: &[Channel],
    ) -> History {
        let mut history = self.recall.history.clone();
        let range = self.recall.sample..sample;
        if !model.signals().is_empty() && !range.is_empty() {
            let (stride, step) = (range.len(), 1.0 / self.rate_hz);
            let mut values = vec![0.0; model.signals().len() * stride];
            self.with_block(range, channels, &[], |motion| {
                model.remember(motion, step, shape, &mut history, stride, &mut values);
            });
        }
        history
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
        let formed;
        let (block, stride, first) = match &self.held {
            Some(all) => (all, self.samples, range.start),
            None => {
                formed = self.block(range.clone());
                (&formed, range.len(), 0)
            }
        };
        let [q, dq, ddq] = [&block.q, &block.dq, &block.ddq].map(|signal| signal.get(first..).unwrap_or(&[]));
        let motion = MotionBlock::plain(range.len(), q, dq, ddq);
        work(&MotionBlock { stride, channels: &channels, ..motion })
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
