//! In which samples a joint moves, and in which it stands.

use dynid_motion::mask::{reversal_threshold, threshold_at};
use rayon::prelude::*;

use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// Least speed of a joint that moves, as a share of its rms speed: the first rung of the usual ladder of reversal masks.
const LEAST_SHARE: f64 = 0.03;
/// Speed, rad/s or m/s, up to which a joint stands however quiet its encoder: the filter of a constant position leaves its rounding.
const ROUNDING: f64 = 1e-9;
/// Time over which a mean speed tells whether a joint stands, s: however noisy the speed of a sample, a joint that moves goes somewhere.
const STAND_S: f64 = 0.2;

/// A speed whose sign friction of an output goes by, in one log.
pub(super) struct ReversalSpeed<'a> {
    /// Combination of rates.
    pub(super) combination: &'a [(usize, f64)],
    /// Its samples.
    pub(super) v: &'a [f64],
    /// Standard deviation of its noise.
    pub(super) sigma: f64,
    /// Its root mean square.
    pub(super) rms: f64,
}

impl ReversalSpeed<'_> {
    /// Speed up to which it is rest: what it lags behind other logs counts, for where a joint is pushed about while the others move, the
    /// log's own rms is that of rest.
    pub(super) fn rest(&self, log: &PreparedLog) -> f64 {
        let outpaced = |(rate, factor): &(usize, f64)| (factor * log.outpaced[*rate]).powi(2);
        let outpaced = self.combination.iter().map(outpaced).sum::<f64>().sqrt();
        (LEAST_SHARE * outpaced).max(ROUNDING)
    }
}

/// Samples about which the mean of every reversal speed is 3 % of its rms or more, and not noise of the positions at either end.
pub(super) fn moving_samples(
    log: &PreparedLog,
    speeds: &[ReversalSpeed<'_>],
    settings: &ConditioningSettings,
) -> usize {
    let half = half_window(log.rate_hz);
    let samples = log.samples();
    let mut moves = vec![true; samples];
    for speed in speeds {
        let noise = |(rate, factor): &(usize, f64)| (factor * log.position_noise[*rate].sigma).powi(2);
        let variance: f64 = speed.combination.iter().map(noise).sum();
        let noise = (2.0 * variance).sqrt() * log.rate_hz / (2 * half) as f64;
        let least = threshold_at(speed.rms, noise, settings.stick_sigma, LEAST_SHARE).max(speed.rest(log));
        let mut way = Vec::with_capacity(samples + 1);
        way.push(0.0);
        speed.v.iter().for_each(|v| way.push(way[way.len() - 1] + v));
        for (n, moves) in moves.iter_mut().enumerate() {
            let (from, to) = (n.saturating_sub(half), (n + half).min(samples));
            *moves &= (way[to] - way[from]).abs() >= least * (to - from) as f64;
        }
    }
    moves.into_iter().filter(|moves| *moves).count()
}

/// Samples to either side over which a mean speed is taken.
fn half_window(rate_hz: f64) -> usize {
    ((0.5 * STAND_S * rate_hz).ceil() as usize).max(1)
}

/// Per output: root mean square of its mean speeds over 0.2 s, rad/s or m/s, in the log in which it is greatest.
pub fn rms_speeds(logs: &[PreparedLog]) -> Vec<f64> {
    let outputs = logs.first().map_or(0, |log| log.position.len());
    let greatest = |output: usize| logs.iter().map(|log| rms_speed(log, output)).fold(0.0, f64::max);
    (0..outputs).into_par_iter().map(greatest).collect()
}

fn rms_speed(log: &PreparedLog, output: usize) -> f64 {
    let span = 2 * half_window(log.rate_hz);
    let q = &log.position[output];
    let ways =
        q.iter().zip(&q[span.min(q.len())..]).map(|(from, to)| (to - from) * log.rate_hz / span as f64);
    let (square, count) = ways.fold((0.0, 0usize), |(square, count), v| (square + v * v, count + 1));
    (square / count.max(1) as f64).sqrt()
}

/// Tells every log how much faster its joints are in others.
pub fn tell_speeds(logs: &mut [PreparedLog]) {
    let greatest = rms_speeds(logs);
    logs.iter_mut().for_each(|log| log.tell_speeds(&greatest));
}

impl PreparedLog {
    /// Tells the log how fast its joints are in other logs, rms ([`rms_speeds`]).
    pub fn tell_speeds(&mut self, greatest: &[f64]) {
        let outpaced = |(output, greatest): (usize, &f64)| (greatest - rms_speed(self, output)).max(0.0);
        self.outpaced = greatest.iter().enumerate().map(outpaced).collect();
    }
}

/// Where the joints of a log move.
///
/// A joint moves where `|v| ≥ max(4 σ_v, 3 % of its rms speed)`, `σ_v` the noise of the speed at the state cut-off: below that the
/// sign of a speed, and with it friction, is a matter of chance. Nor does it move below 3 % of what its rms speed in other logs is above that in
/// this one. A joint that the log does not move at all stands throughout.
#[derive(Debug, Clone, PartialEq)]
pub struct Moving {
    /// Per output: least speed of a joint that moves, rad/s or m/s.
    pub least_speed: Vec<f64>,
    /// Per output and sample: whether it moves.
    pub samples: Vec<Vec<bool>>,
}

impl Moving {
    /// Of a log with its states.
    pub fn new(log: &PreparedLog, states: &States, settings: &ConditioningSettings) -> Moving {
        let of_output = |j: usize| {
            let v = states.velocity(j);
            let least = reversal_threshold(&v, states.velocity_sigma[j], settings.stick_sigma, LEAST_SHARE)
                .max(LEAST_SHARE * log.outpaced[j]);
            (least, v.iter().map(|v| log.moves[j] && *v != 0.0 && v.abs() >= least).collect())
        };
        let (least_speed, samples) = (0..log.position.len()).into_par_iter().map(of_output).unzip();
        Moving { least_speed, samples }
    }

    /// Of a log at a state cut-off, Hz, which counts up to what the sample rate allows.
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for a signal that cannot be filtered.
    pub fn of(
        log: &PreparedLog,
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<Moving, ConditioningError> {
        Ok(Moving::new(log, &States::of_motion(log, state_hz, settings)?, settings))
    }
}

impl States {
    /// The same with zero velocity wherever a joint stands: its sign there is that of noise, and friction may have any value up to static
    /// friction. A prediction along such states is the middle of what it may be, and does not jump.
    #[must_use]
    pub fn resting(mut self, moving: &Moving) -> States {
        self.moves = Some(moving.samples.clone());
        self
    }
}
