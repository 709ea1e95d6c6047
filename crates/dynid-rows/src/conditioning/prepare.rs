//! From a log to clean uniform signals with known noise.

mod averaged;

pub use averaged::PeriodsAveraged;

use std::sync::Arc;

use dynid_model::EffortModel;
use dynid_motion::clock::{self, ClockReport};
use dynid_motion::repetition::repetition;
use dynid_motion::spectrum::{EffortNoise, PositionNoise, effort_noise, position_noise};
use dynid_motion::spikes::{self, SpikeLevel};
use dynid_motion::{Channel, Log};
use rayon::prelude::*;

use super::{ConditioningError, ConditioningSettings};

/// A log on a uniform grid without spikes, joints in the order of the model's outputs.
#[derive(Debug, Clone)]
pub struct PreparedLog {
    /// Name of the log.
    pub name: String,
    /// Time of the first sample, s.
    pub start: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Per output: position, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Per output: effort, N m or N; shared with what is compared with it and drawn beside it.
    pub effort: Vec<Arc<Vec<f64>>>,
    /// Extra channels.
    pub channels: Vec<Channel>,
    /// Per sample: false inside a gap of the clock.
    pub usable: Vec<bool>,
    /// Per output: noise and band of the position.
    pub position_noise: Vec<PositionNoise>,
    /// Per output: noise of the effort.
    pub effort_noise: Vec<EffortNoise>,
    /// Per output: spikes removed from position and effort.
    pub spikes: Vec<(usize, usize)>,
    /// Per output: what position and effort tell of the spikes of a longer record.
    pub spike_levels: Vec<[SpikeLevel; 2]>,
    /// Per output: whether the joint moves in this log.
    pub moves: Vec<bool>,
    /// Per output: whether something else than its drive holds the joint in this log, such as its brake: it does not move, and its effort
    /// never changes. Its rows tell nothing and do not count.
    pub held: Vec<bool>,
    /// Per output: by how much its rms speed in another log is above that in this one, rad/s or m/s; zeros before [`tell_speeds`](super::tell_speeds).
    pub outpaced: Vec<f64>,
    /// Per output: root mean squares of its reversal speeds behind the masks; `None`: those of the samples at hand.
    pub speed_rms: Option<Arc<Vec<Vec<f64>>>>,
    /// What was found about the clock.
    pub clock: ClockReport,
    /// Time after which the motion repeats, samples, not whole; `None` where it does not.
    pub repeats_after: Option<f64>,
    /// The motion that it shares with other logs ([`tell_shared_motions`](super::tell_shared_motions)); `None` where none repeats it.
    pub shared: Option<SharedMotion>,
    /// Motion of a known period, if one was stated; states then come from it.
    pub periodic: Option<PeriodicMotion>,
    /// What was averaged, if the log is the mean of its periods ([`PreparedLog::averaged`]).
    pub averaged: Option<PeriodsAveraged>,
}

/// The motion that several logs share, as the first of them holds it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SharedMotion {
    /// Which motion: the place of the first log that holds it among those that were compared.
    pub motion: usize,
    /// Samples by which a sample of this log lies behind that of the first one.
    pub(super) lag: f64,
}

/// Periodic motion found in a log; see [`PreparedLog::with_period`].
#[derive(Debug, Clone)]
pub struct PeriodicMotion {
    /// Period after which the positions repeat, s of the log's clock.
    pub period_s: f64,
    /// Whole periods in the log.
    pub periods: usize,
    /// Per output: number of harmonics.
    pub harmonics: Vec<usize>,
    /// Per output: RMS of measured positions about the series in parts of the position noise: about 1 where the motion
    /// repeats, more where it does not. `None` without noise.
    pub residual_ratio: Vec<Option<f64>>,
    /// Per output: standard deviation of the velocity that follows from position noise, per s.
    pub velocity_sigma: Vec<f64>,
    /// Per output: positions at all samples.
    pub q: Vec<Vec<f64>>,
    /// Velocities.
    pub dq: Vec<Vec<f64>>,
    /// Accelerations.
    pub ddq: Vec<Vec<f64>>,
}

impl PreparedLog {
    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.usable.len()
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.samples() as f64 / self.rate_hz
    }

    /// Positions of the joints that move.
    pub(super) fn moving(&self) -> Vec<&[f64]> {
        let moving = self.position.iter().zip(&self.moves).filter(|(_, moves)| **moves);
        moving.map(|(position, _)| position.as_slice()).collect()
    }
}

/// Puts a log on a uniform grid, removes spikes, measures noise and band.
///
/// Fails if a joint of the model is not logged, it moves and its effort never changes though a drive acts on it, a channel is missing, or the
/// clock is beyond repair.
pub fn prepare(
    log: &Log,
    model: &dyn EffortModel,
    settings: &ConditioningSettings,
) -> Result<PreparedLog, ConditioningError> {
    let mut uniform = clock::uniform(log, &settings.clock)?;
    for channel in model.channels() {
        if !uniform.channels.iter().any(|c| c.name == *channel) {
            return Err(ConditioningError::MissingChannel { log: uniform.name, channel: channel.clone() });
        }
    }
    let mut joints = Vec::with_capacity(model.outputs().len());
    let mut held = Vec::with_capacity(model.outputs().len());
    for (number, output) in model.outputs().iter().enumerate() {
        let Some(index) = uniform.joints.iter().position(|j| j.name == output.name) else {
            return Err(ConditioningError::MissingJoint { log: uniform.name, joint: output.name.clone() });
        };
        let joint = uniform.joints.swap_remove(index);
        let constant = joint.effort_is_constant() && !model.is_undriven(number);
        held.push(constant && !joint.moves());
        if constant && joint.moves() {
            return Err(ConditioningError::ConstantEffort { log: uniform.name, joint: joint.name });
        }
        joints.push(joint);
    }
    if !joints.iter().any(dynid_motion::JointSignals::moves) {
        return Err(ConditioningError::NothingMoves { log: uniform.name });
    }
    let rate_hz = uniform.rate_hz;
    let done: Vec<_> = joints
        .into_par_iter()
        .map(|mut joint| {
            let moves = joint.moves();
            let mut counts = (0, 0);
            let mut levels = [SpikeLevel::NONE; 2];
            if settings.remove_spikes {
                let p = spikes::remove(&mut joint.position, &settings.position_spikes)?;
                let e = spikes::remove(&mut joint.effort, &settings.effort_spikes)?;
                let count = |r: &spikes::SpikeReport| if r.removed { r.flagged.len() } else { 0 };
                counts = (count(&p), count(&e));
                levels = [p.level(), e.level()];
            }
            let position = position_noise(&joint.position, rate_hz, &settings.noise)?;
            let effort = effort_noise(&joint.effort, rate_hz, &settings.noise)?;
            Ok((joint, moves, counts, levels, position, effort))
        })
        .collect::<Result<_, ConditioningError>>()?;
    let mut out = PreparedLog {
        name: uniform.name,
        start: uniform.start,
        rate_hz,
        position: Vec::new(),
        effort: Vec::new(),
        channels: uniform.channels,
        usable: uniform.usable,
        position_noise: Vec::new(),
        effort_noise: Vec::new(),
        spikes: Vec::new(),
        spike_levels: Vec::new(),
        moves: Vec::new(),
        outpaced: vec![0.0; held.len()],
        held,
        speed_rms: None,
        clock: uniform.report,
        repeats_after: None,
        shared: None,
        periodic: None,
        averaged: None,
    };
    for (joint, moves, counts, levels, position, effort) in done {
        out.position.push(joint.position);
        out.effort.push(Arc::new(joint.effort));
        out.spikes.push(counts);
        out.spike_levels.push(levels);
        out.moves.push(moves);
        out.position_noise.push(position);
        out.effort_noise.push(effort);
    }
    out.repeats_after = repetition(&out.moving(), rate_hz);
    Ok(out)
}
