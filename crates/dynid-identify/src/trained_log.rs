//! What is known of a training log without its samples, and how well its rows are explained.

use std::ops::Range;

use dynid_estimate::metrics::Fit;
use dynid_rows::conditioning::{PreparedLog, motions};
use serde::{Deserialize, Serialize};

/// Positions are compared over this time, s: spikes and noise count little then.
pub(crate) const SPEED_SPAN_S: f64 = 0.05;

/// A training log without its samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct TrainedLog {
    /// Name.
    pub name: String,
    /// Samples on its uniform grid.
    pub samples: usize,
    /// Length, s.
    pub duration_s: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Time after which the motion repeats, s; absent where it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats_after_s: Option<f64>,
    /// Log before it whose motion it repeats; absent where there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub same_motion_as: Option<String>,
    /// Per output: standard deviation of the noise of the position, rad or m.
    pub position_noise: Vec<f64>,
    /// Per output: standard deviation of the noise of the effort, N m or N.
    pub effort_noise: Vec<f64>,
    /// Per output: whether its joint moves.
    pub moves: Vec<bool>,
    /// Per output: least and greatest velocity, rad/s or m/s, as means over 0.05 s, rest among them; absent where its joint does not
    /// move.
    pub velocities: Vec<Option<(f64, f64)>>,
    /// Channels at their least and at their greatest values.
    pub channels: Vec<(String, f64, f64)>,
}

impl TrainedLog {
    /// Rate, noise and motion of a log, without what its samples tell otherwise.
    pub(crate) fn of_moves(log: &PreparedLog) -> Self {
        TrainedLog {
            name: log.name.clone(),
            samples: log.samples(),
            duration_s: log.duration(),
            rate_hz: log.rate_hz,
            same_motion_as: None,
            repeats_after_s: log.repeats_after.map(|samples| samples / log.rate_hz),
            position_noise: log.position_noise.iter().map(|noise| noise.sigma).collect(),
            effort_noise: log.effort_noise.iter().map(|noise| noise.sigma).collect(),
            moves: log.moves.clone(),
            velocities: vec![None; log.moves.len()],
            channels: Vec::new(),
        }
    }

    /// All training logs.
    pub(crate) fn of_all(logs: &[PreparedLog]) -> Vec<Self> {
        let mut out: Vec<Self> = logs.iter().map(TrainedLog::of).collect();
        for (k, motion) in motions(logs).into_iter().enumerate().filter(|(k, motion)| *k != motion.first) {
            out[k].same_motion_as = Some(out[motion.first].name.clone());
        }
        out
    }

    /// Length without what repeats, in itself or an earlier log, s.
    pub fn distinct_s(&self) -> f64 {
        if self.same_motion_as.is_some() {
            return 0.0;
        }
        self.repeats_after_s.unwrap_or(f64::INFINITY).min(self.duration_s)
    }

    pub(crate) fn of(log: &PreparedLog) -> Self {
        let range = |values: &[f64]| {
            let (low, high) = (f64::INFINITY, f64::NEG_INFINITY);
            values.iter().fold((low, high), |(low, high), x| (low.min(*x), high.max(*x)))
        };
        let channels = log.channels.iter().map(|c| {
            let (low, high) = range(&c.values);
            (c.name.clone(), low, high)
        });
        TrainedLog {
            velocities: (0..log.moves.len()).map(|output| velocities(log, output)).collect(),
            channels: channels.filter(|(_, low, high)| low <= high).collect(),
            ..TrainedLog::of_moves(log)
        }
    }
}

/// Figures of a fit on the rows of one log.
#[derive(Debug, Clone)]
pub struct RowFit {
    /// Log.
    pub log: String,
    /// Figures on the rows of the widest kernel, output by output, without correlations; R² of outputs that move in the log alone.
    pub fit: Fit,
}

/// Least and greatest mean velocity of an output over [`SPEED_SPAN_S`], with rest; `None` if it does not move.
fn velocities(log: &PreparedLog, output: usize) -> Option<(f64, f64)> {
    log.moves[output].then(|| velocities_in(log, output, 0..log.samples()))?
}

/// Least and greatest mean velocity over [`SPEED_SPAN_S`] that ends in a run of samples, with rest; `None` if none does.
pub(crate) fn velocities_in(log: &PreparedLog, output: usize, samples: Range<usize>) -> Option<(f64, f64)> {
    let position = &log.position[output];
    let span = ((SPEED_SPAN_S * log.rate_hz).ceil() as usize).max(1);
    let mut range: Option<(f64, f64)> = None;
    let mut sound = 0;
    let from = samples.start.saturating_sub(span + 1);
    for (k, usable) in log.usable.iter().enumerate().take(samples.end).skip(from) {
        sound = if *usable { sound + 1 } else { 0 };
        if sound > span && k >= samples.start {
            let v = (position[k] - position[k - span]) * log.rate_hz / span as f64;
            let (low, high) = range.unwrap_or((0.0, 0.0));
            range = Some((low.min(v), high.max(v)));
        }
    }
    range
}
