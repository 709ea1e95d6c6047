//! Delays of single logs, taken off before anything else is chosen.

use dynid_model::{BaseParameters, RobotModel};
use dynid_motion::shift;
use dynid_rows::conditioning::{PreparedLog, condition};
use serde::{Deserialize, Serialize};

use crate::Error;
use crate::settings::{Own, Route, Settings};
use crate::training_log::TrainingLog;

/// A log with a delay of its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct OwnDelay {
    /// Log.
    pub log: String,
    /// Delay of the motion behind the logged effort in this log alone, samples.
    pub samples: f64,
    /// Half width of its 95 % interval, samples.
    pub half_width: f64,
    /// Delay of the logs without a delay of their own, samples; the difference is taken off the log's efforts.
    pub reference: f64,
    /// The search ran into a limit: a warning, not a value.
    pub at_limit: bool,
}

impl OwnDelay {
    /// Takes the difference to the reference off the efforts of a log.
    pub(super) fn take_off(&self, log: &mut PreparedLog) -> Result<(), Error> {
        for effort in &mut log.effort {
            let shifted = shift::shift(effort, self.reference - self.samples);
            *effort = shifted.map_err(|e| Error::Conditioning(e.into()))?.values.into();
        }
        Ok(())
    }
}

/// Finds the delays of logs that have their own, log by log, and takes what they have more than the others off their
/// efforts, so that all logs share one delay from here on.
///
/// # Errors
/// [`Error::Setting`] where a delay is given or rates differ, [`Error::Unsupported`] on the textbook route,
/// [`Error::Conditioning`].
pub(super) fn take_off(
    asked: &Settings,
    training: &[TrainingLog],
    model: &RobotModel,
    shape: &[f64],
    base: &BaseParameters,
    logs: &mut [PreparedLog],
) -> Result<Vec<OwnDelay>, Error> {
    let settings = &asked.conditioning_settings();
    let states = |k: usize| training[k].settings.own.contains(&Own::Delay);
    let all = (0..logs.len()).all(states);
    let own: Vec<usize> = (0..logs.len()).filter(|k| states(*k) && !(all && *k == 0)).collect();
    if own.is_empty() {
        return Ok(Vec::new());
    }
    if asked.conditioning.route == Route::Textbook {
        return Err(Error::Unsupported(
            "delays of single logs on the textbook route: it finds none".to_owned(),
        ));
    }
    if let Some(given) = settings.delay_samples {
        return Err(Error::setting("delay_samples", "none beside `own = [\"delay\"]`", given));
    }
    let rate = logs[0].rate_hz;
    if let Some(other) = logs.iter().find(|l| (l.rate_hz / rate - 1.0).abs() > 0.05) {
        let expected = format!("logs of one sample rate for `own = [\"delay\"]`, {rate} Hz as the first");
        return Err(Error::setting("log.own", &expected, format!("{} Hz in {}", other.rate_hz, other.name)));
    }
    // What belongs to single logs repeats other columns within a log.
    let columns = model.log_columns();
    let kept: Vec<usize> = base.kept.iter().copied().filter(|c| !columns.contains(c)).collect();
    let reference: Vec<PreparedLog> =
        (0..logs.len()).filter(|k| !own.contains(k)).map(|k| logs[k].clone()).collect();
    let delay_of =
        |logs: &[PreparedLog]| condition(model, shape, &kept, logs, settings, &mut |_| {}).map(|c| c.delay);
    let common = delay_of(&reference)?;
    drop(reference);
    own.into_iter()
        .map(|k| {
            let found = delay_of(std::slice::from_ref(&logs[k]))?;
            let own = OwnDelay {
                log: training[k].label.clone(),
                samples: found.samples,
                half_width: found.half_width,
                reference: common.samples,
                at_limit: found.at_limit,
            };
            own.take_off(&mut logs[k])?;
            Ok(own)
        })
        .collect()
}
