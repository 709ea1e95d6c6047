//! Windows of a log that is longer than memory, prepared by what a part of it told.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use dynid_model::EffortModel;
use dynid_motion::log::moves;
use dynid_motion::signal::rms;
use dynid_motion::spectrum::{EffortNoise, PositionNoise};
use dynid_motion::spikes::{self, SpikeLevel};
use dynid_motion::{Channel, ClockReport};
use rayon::prelude::*;

use super::rows::Kernels;
use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog};

/// What the conditioning of a log takes from its samples beside a recipe's choices: noise, levels of spikes, speeds behind the masks.
///
/// It is measured on a part of a long log, so that the log can be conditioned window by window.
#[derive(Debug, Clone)]
pub struct RecordFigures {
    clock: ClockReport,
    position_noise: Vec<PositionNoise>,
    effort_noise: Vec<EffortNoise>,
    spikes: Vec<[SpikeLevel; 2]>,
    held: Vec<bool>,
    outpaced: Vec<f64>,
    speed_rms: Arc<Vec<Vec<f64>>>,
}

/// What rows of a window take from beyond it, samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct WindowReach {
    /// Half width of the widest kernel.
    pub kernels: usize,
    /// Samples on either side of a window that its rows go by: beyond them kernels (3.5 standard deviations), the delay, and what is left of the
    /// state filter's start, less than 1e-16 of it, do not reach. A second of them belongs to spikes and to velocities that are means.
    pub overlap: usize,
    /// Windows begin at multiples of this, so that their rows are on the grid of the whole log's rows.
    pub grid: usize,
}

/// Samples of a window, joints in the order of the outputs.
#[derive(Debug, Clone, Default)]
pub struct Window {
    /// Per output: position, rad or m.
    pub position: Vec<Vec<f64>>,
    /// Per output: effort, N m or N.
    pub effort: Vec<Vec<f64>>,
    /// Extra channels.
    pub channels: Vec<Channel>,
    /// Per sample: false inside a gap of the clock.
    pub usable: Vec<bool>,
}

impl RecordFigures {
    /// Figures of a part of a log. `state_hz`: cut-off of its state filter, Hz.
    ///
    /// # Errors
    /// As [`States::new`].
    pub fn of(
        part: &PreparedLog,
        model: &dyn EffortModel,
        state_hz: f64,
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        let states = States::of_motion_at(part, state_hz, settings)?;
        let of_output = |output: usize| -> Vec<f64> {
            let speeds = model.reversal_speeds(output);
            speeds.iter().map(|speed| rms(&states.combined(speed).0)).collect()
        };
        Ok(RecordFigures {
            clock: part.clock.clone(),
            position_noise: part.position_noise.clone(),
            effort_noise: part.effort_noise.clone(),
            spikes: part.spike_levels.clone(),
            held: part.held.clone(),
            outpaced: part.outpaced.clone(),
            speed_rms: Arc::new((0..model.outputs().len()).into_par_iter().map(of_output).collect()),
        })
    }

    /// Clock of the part.
    pub fn clock(&self) -> &ClockReport {
        &self.clock
    }

    /// Where windows of the log may lie.
    ///
    /// # Errors
    /// As [`dynid_motion::Kernel::new`].
    pub fn overlap(
        &self,
        scales_hz: &[f64],
        state_hz: f64,
        delay_samples: f64,
        settings: &ConditioningSettings,
    ) -> Result<WindowReach, ConditioningError> {
        let kernels = Kernels::of_rate(scales_hz, self.clock.rate_hz)?;
        let (reach, grid) = kernels.reach_and_grid();
        // The slowest pole of a Butterworth of order `n` decays at this rate.
        let decay = TAU * state_hz * (PI / (2.0 * settings.state_order.max(1) as f64)).sin();
        let seconds = -FORGOTTEN.ln() / decay + 1.0;
        let samples = (seconds * self.clock.rate_hz + delay_samples.abs()).ceil() as usize + SPIKE_REACH;
        Ok(WindowReach { kernels: reach, overlap: reach + samples, grid })
    }
}

/// Share of the state filter's start that is no longer seen.
const FORGOTTEN: f64 = 1e-17;
/// What the judgement of a spike looks at on either side, samples, and some more.
const SPIKE_REACH: usize = 64;

impl PreparedLog {
    /// A window of a log, without its spikes.
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for a number that is not finite.
    pub fn of_window(
        name: &str,
        window: Window,
        figures: &RecordFigures,
        settings: &ConditioningSettings,
    ) -> Result<PreparedLog, ConditioningError> {
        let Window { mut position, mut effort, channels, usable } = window;
        let mut counts = vec![(0, 0); position.len()];
        if settings.remove_spikes {
            counts = position
                .par_iter_mut()
                .zip(&mut effort)
                .zip(&figures.spikes)
                .map(|((position, effort), [of_position, of_effort])| {
                    let p = spikes::remove_at(position, *of_position, &settings.position_spikes)?;
                    let e = spikes::remove_at(effort, *of_effort, &settings.effort_spikes)?;
                    Ok((p.len(), e.len()))
                })
                .collect::<Result<_, ConditioningError>>()?;
        }
        // A joint that was held may move later.
        let still = |output: usize| {
            !moves(&position[output]) && effort[output].windows(2).all(|pair| pair[0] == pair[1])
        };
        let held = figures.held.iter().enumerate().map(|(output, held)| *held && still(output)).collect();
        Ok(PreparedLog {
            name: name.to_owned(),
            start: 0.0,
            rate_hz: figures.clock.rate_hz,
            moves: vec![true; position.len()],
            held,
            outpaced: figures.outpaced.clone(),
            position,
            effort: effort.into_iter().map(Arc::new).collect(),
            channels,
            usable,
            position_noise: figures.position_noise.clone(),
            effort_noise: figures.effort_noise.clone(),
            spikes: counts,
            spike_levels: figures.spikes.clone(),
            speed_rms: Some(figures.speed_rms.clone()),
            clock: figures.clock.clone(),
            repeats_after: None,
            shared: None,
            periodic: None,
            averaged: None,
        })
    }
}
