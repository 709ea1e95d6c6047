//! A record as trial models see it: filtered, thinned, away from edges.

use super::wiring::{Source, Wiring};
use dynid_motion::cutoff::{CutoffSettings, kernel_limit};
use dynid_motion::difference::{central, central_part};
use dynid_motion::filter::{Sections, butterworth, forward_backward_in_step};
use dynid_motion::mask::{dilate, near_reversal};
use dynid_motion::signal::rms;
use dynid_motion::spectrum::{NoiseSettings, position_noise};
use dynid_motion::{Channel, SignalError, UniformLog};
use rayon::prelude::*;

/// Highest cut-off of a pre-flight, Hz: what rigid bodies do lies below, what joints and sensors do above.
const HIGHEST_HZ: f64 = 10.0;
/// Samples kept per period of the cut-off.
const PER_PERIOD: f64 = 4.0;
/// Most samples kept.
const MOST: usize = 2000;
/// Share of the rms speed below which a joint counts as reversing.
const REVERSAL: f64 = 0.1;
/// Parts of the record that statistics are formed over.
pub(crate) const BLOCKS: usize = 12;
/// Fewest samples worth a trial.
const FEWEST: usize = 60;

/// The filter of a pre-flight.
pub(super) fn low_pass(cutoff_hz: f64, rate_hz: f64) -> Result<Sections, SignalError> {
    butterworth(4, cutoff_hz, rate_hz)
}

/// Signals of one joint at the kept samples.
#[derive(Debug, Clone)]
pub(crate) struct JointSamples {
    pub(crate) position: Vec<f64>,
    pub(crate) velocity: Vec<f64>,
    pub(crate) acceleration: Vec<f64>,
    pub(crate) effort: Vec<f64>,
    /// Whether the joint is away from reversal.
    pub(crate) sliding: Vec<bool>,
    /// Whether the joint moves at all.
    pub(crate) moves: bool,
}

/// Signals of a log through one zero-phase low-pass, thinned, without ends, gaps and what borders on them.
#[derive(Debug, Clone)]
pub struct Samples {
    pub(crate) joints: Vec<JointSamples>,
    pub(crate) channels: Vec<Channel>,
    /// Per sample: which of [`BLOCKS`] parts of the record it belongs to.
    pub(crate) block: Vec<usize>,
    /// Per sample: its place in the log.
    pub(crate) kept: Vec<usize>,
    /// Cut-off, Hz.
    pub cutoff_hz: f64,
    /// Time that the samples stand for, s.
    pub duration_s: f64,
    /// Sample rate of the log, Hz.
    pub rate_hz: f64,
}

impl Samples {
    /// Filters and thins a log whose joints are in the order of a model's outputs; `None` if no joint moves or too little
    /// is left.
    ///
    /// `moves`: per joint, whether it moves in the log as recorded. The cut-off is what noise and sample rate allow, at most
    /// 10 Hz.
    ///
    /// # Errors
    /// [`SignalError`] if a signal is too short for the filter.
    ///
    /// # Panics
    /// Unless there is one entry of `moves` per joint.
    pub fn new(log: &UniformLog, moves: &[bool]) -> Result<Option<Samples>, SignalError> {
        assert_eq!(moves.len(), log.joints.len(), "one entry of moves per joint");
        let moving: Vec<_> =
            log.joints.iter().zip(moves).filter(|(_, moves)| **moves).map(|(j, _)| j).collect();
        let noise = moving
            .into_par_iter()
            .map(|j| position_noise(&j.position, log.rate_hz, &NoiseSettings::default()))
            .collect::<Result<Vec<_>, _>>()?;
        let Some(limit) = kernel_limit(&noise, log.rate_hz, &CutoffSettings::default()) else {
            return Ok(None);
        };
        let efforts: Vec<&[f64]> = log.joints.iter().map(|joint| joint.effort.as_slice()).collect();
        Samples::filtered(log, &efforts, &log.usable, moves, limit.limit_hz.min(HIGHEST_HZ))
    }

    /// [`Samples::new`] at a cut-off, Hz, and with other efforts and usable samples than those of the log.
    pub(super) fn filtered(
        log: &UniformLog,
        efforts: &[&[f64]],
        usable: &[bool],
        moves: &[bool],
        cutoff_hz: f64,
    ) -> Result<Option<Samples>, SignalError> {
        let filter = low_pass(cutoff_hz, log.rate_hz)?;
        let n = log.samples();
        let reach = (2.0 * log.rate_hz / cutoff_hz).ceil() as usize;
        let bad: Vec<bool> = usable.iter().map(|u| !u).collect();
        let near_gap = dilate(&bad, reach / 2);
        let thin = ((log.rate_hz / (PER_PERIOD * cutoff_hz)) as usize).max(n.div_ceil(MOST)).max(1);
        let kept: Vec<usize> =
            (reach..n.saturating_sub(reach)).step_by(thin).filter(|k| !near_gap[*k]).collect();
        if kept.len() < FEWEST {
            return Ok(None);
        }
        let pick = |signal: &[f64]| kept.iter().map(|k| signal[*k]).collect::<Vec<_>>();
        let joints = log
            .joints
            .par_iter()
            .zip(efforts)
            .zip(moves)
            .map(|((joint, effort), moves)| {
                let [position, effort] = forward_backward_in_step(&filter, [&joint.position, effort])?;
                // Of signals as long as the log no more are held at a time than need be.
                let effort = pick(&effort);
                let velocity = central(&position, log.rate_hz)?;
                let position = pick(&position);
                let acceleration = |k: &usize| {
                    let mut at = [0.0];
                    central_part(&velocity, log.rate_hz, *k..*k + 1, &mut at);
                    at[0]
                };
                let reversing = near_reversal(&velocity, REVERSAL * rms(&velocity));
                let reversing = dilate(&reversing, reach / 4);
                Ok(JointSamples {
                    position,
                    acceleration: kept.iter().map(acceleration).collect(),
                    velocity: pick(&velocity),
                    effort,
                    // At rest friction has any value, and rows would weigh as much as the effort is steady.
                    sliding: kept.iter().map(|k| *moves && !reversing[*k]).collect(),
                    moves: *moves,
                })
            })
            .collect::<Result<Vec<_>, SignalError>>()?;
        let channels =
            log.channels.iter().map(|c| Channel { name: c.name.clone(), values: pick(&c.values) }).collect();
        let count = kept.len();
        Ok(Some(Samples {
            joints,
            channels,
            block: (0..count).map(|k| k * BLOCKS / count).collect(),
            kept,
            cutoff_hz,
            duration_s: count as f64 * thin as f64 / log.rate_hz,
            rate_hz: log.rate_hz,
        }))
    }

    /// Efforts as a wiring reads them, joint by joint, at the kept samples.
    pub fn efforts(&self, wiring: &Wiring) -> Vec<Vec<f64>> {
        let of = |s: &Source| self.joints[s.joint].effort.iter().map(|e| s.factor * e).collect();
        wiring.effort.iter().map(of).collect()
    }

    /// Share of the samples in which a joint moves, away from reversal and rest.
    pub fn sliding_share(&self, joint: usize) -> f64 {
        let sliding = &self.joints[joint].sliding;
        sliding.iter().filter(|sliding| **sliding).count() as f64 / sliding.len().max(1) as f64
    }

    pub(crate) fn len(&self) -> usize {
        self.block.len()
    }
}
