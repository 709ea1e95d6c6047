//! The textbook route: zero-phase Butterworth, central differences, trimmed edges, decimation.
//!
//! Source: Gautier 1997; in this form Tadese, Pico, Seo & Moon 2022 (every 80th sample at 4 kHz) and Janot, Gautier &
//! Brunot 2019 (EMPS, MATLAB `decimate`). Where regressor columns are to be decimated like the effort, take the pieces:
//! [`states`], [`trim`], [`crate::filter::decimate()`].

use crate::clock::UniformLog;
use crate::difference::central;
use crate::filter::{Sections, anti_alias, butterworth, forward_backward, pick};
use crate::log::Channel;
use crate::mask::dilate;
use crate::signal::SignalError;

/// Settings of the textbook route.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookSettings {
    /// Cut-off of the low-pass, Hz. Default 10.
    pub cutoff_hz: f64,
    /// Order of the Butterworth, even; it runs forward and backward. Default 4.
    pub order: usize,
    /// Keep every so many samples. Default `None`: keep all.
    pub decimation: Option<usize>,
    /// Anti-alias every signal before decimating (otherwise samples are only picked). The first sample after the trim
    /// is kept either way. Default false.
    pub anti_alias: bool,
    /// Time cut from either end after filtering, s. Default 1.
    pub trim_s: f64,
}

impl Default for TextbookSettings {
    fn default() -> Self {
        Self { cutoff_hz: 10.0, order: 4, decimation: None, anti_alias: false, trim_s: 1.0 }
    }
}

/// Position, velocity and acceleration on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct States {
    /// rad or m.
    pub position: Vec<f64>,
    /// Per s.
    pub velocity: Vec<f64>,
    /// Per s^2.
    pub acceleration: Vec<f64>,
}

/// Filtered position and its first and second central differences, at the full rate and length.
///
/// Fails if the signal is not longer than the filter's padding (15 samples for order 4), not finite, or a setting is
/// out of range.
pub fn states(position: &[f64], rate_hz: f64, settings: &TextbookSettings) -> Result<States, SignalError> {
    let filter = low_pass(rate_hz, settings)?;
    let position = forward_backward(&filter, position)?;
    let velocity = central(&position, rate_hz)?;
    let acceleration = central(&velocity, rate_hz)?;
    Ok(States { position, velocity, acceleration })
}

/// States of the textbook route as [`states`] forms them, with the velocity taken from a measurement that passes the same filter.
pub fn states_with_velocity(
    position: &[f64],
    velocity: &[f64],
    rate_hz: f64,
    settings: &TextbookSettings,
) -> Result<States, SignalError> {
    if velocity.len() != position.len() {
        return Err(SignalError::Length {
            what: "velocity",
            expected: position.len(),
            found: velocity.len(),
        });
    }
    let filter = low_pass(rate_hz, settings)?;
    let velocity = forward_backward(&filter, velocity)?;
    let acceleration = central(&velocity, rate_hz)?;
    Ok(States { position: forward_backward(&filter, position)?, velocity, acceleration })
}

/// The low-pass of the settings.
pub fn low_pass(rate_hz: f64, settings: &TextbookSettings) -> Result<Sections, SignalError> {
    butterworth(settings.order, settings.cutoff_hz, rate_hz)
}

/// The signal without `trim_s` at either end. Fails if nothing is left or the time is negative or not finite.
pub fn trim<'a, T>(
    signal: &'a [T],
    rate_hz: f64,
    settings: &TextbookSettings,
) -> Result<&'a [T], SignalError> {
    let width = trim_width(rate_hz, settings)?;
    let expected = width.saturating_mul(2).saturating_add(1);
    if signal.len() < expected {
        return Err(SignalError::TooShort { expected, found: signal.len() });
    }
    Ok(&signal[width..signal.len() - width])
}

fn trim_width(rate_hz: f64, settings: &TextbookSettings) -> Result<usize, SignalError> {
    let found = settings.trim_s;
    if !(found >= 0.0 && found.is_finite()) {
        return Err(SignalError::Setting { name: "trim_s", expected: "0 or more, finite", found });
    }
    Ok((found * rate_hz).round() as usize)
}

/// One joint after the textbook route.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookJoint {
    /// Joint name.
    pub name: String,
    /// States.
    pub states: States,
    /// Filtered effort, N m or N.
    pub effort: Vec<f64>,
}

/// A log after the textbook route.
#[derive(Debug, Clone, PartialEq)]
pub struct Textbook {
    /// Time of the first sample kept, s.
    pub start: f64,
    /// Sample rate after decimation, Hz.
    pub rate_hz: f64,
    /// Joints in order.
    pub joints: Vec<TextbookJoint>,
    /// Further channels: filtered and decimated like the effort.
    pub channels: Vec<Channel>,
    /// Per sample kept: false within `1 / cutoff` of a gap of the clock.
    pub usable: Vec<bool>,
}

/// Runs the textbook route over a log; a measured velocity is used where there is one.
///
/// Fails as [`states`], [`trim`] and [`anti_alias`] do.
pub fn textbook(log: &UniformLog, settings: &TextbookSettings) -> Result<Textbook, SignalError> {
    let rate = log.rate_hz;
    let filter = low_pass(rate, settings)?;
    let thin = |signal: &[f64]| thin(signal, rate, settings);
    let mut joints = Vec::with_capacity(log.joints.len());
    for joint in &log.joints {
        let full = match &joint.velocity {
            Some(velocity) => states_with_velocity(&joint.position, velocity, rate, settings)?,
            None => states(&joint.position, rate, settings)?,
        };
        joints.push(TextbookJoint {
            name: joint.name.clone(),
            states: States {
                position: thin(&full.position)?,
                velocity: thin(&full.velocity)?,
                acceleration: thin(&full.acceleration)?,
            },
            effort: thin(&forward_backward(&filter, &joint.effort)?)?,
        });
    }
    let mut channels = Vec::with_capacity(log.channels.len());
    for channel in &log.channels {
        let values = thin(&forward_backward(&filter, &channel.values)?)?;
        channels.push(Channel { name: channel.name.clone(), values });
    }
    let factor = settings.decimation.unwrap_or(1).max(1);
    Ok(Textbook {
        start: log.time(trim_width(rate, settings)?),
        rate_hz: rate / factor as f64,
        joints,
        channels,
        usable: pick(trim(&clear_of_gaps(log, settings), rate, settings)?, factor, 0),
    })
}

fn thin(signal: &[f64], rate_hz: f64, settings: &TextbookSettings) -> Result<Vec<f64>, SignalError> {
    let inner = trim(signal, rate_hz, settings)?;
    let factor = settings.decimation.unwrap_or(1);
    if settings.anti_alias || factor == 0 {
        return Ok(pick(&anti_alias(inner, factor)?, factor, 0));
    }
    Ok(pick(inner, factor, 0))
}

fn clear_of_gaps(log: &UniformLog, settings: &TextbookSettings) -> Vec<bool> {
    let gaps: Vec<bool> = log.usable.iter().map(|u| !u).collect();
    let reach = (log.rate_hz / settings.cutoff_hz).ceil() as usize;
    dilate(&gaps, reach).into_iter().map(|bad| !bad).collect()
}
