//! Delay between effort and motion, by the estimator of identification.

use dynid_motion::shift::shift;
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, condition};

use super::bench::Bench;
use crate::Error;
use crate::finding::{FindingId, Findings, Fix, Severity};
use crate::log::Log;
use crate::settings::{Route, Settings};

/// Delays between these are ordinary, samples: a command is held over a sample, a sensor filters.
const ORDINARY: (f64, f64) = (-1.0, 2.5);
/// Deviation from a stated delay that is no fault, samples.
const AS_STATED: f64 = 1.0;
/// Largest delay that identification finds by itself, samples and s.
const FOUND_BY_ITSELF: (f64, f64) = (3.0, 0.02);
/// A delay counts beyond this many standard errors.
const SURE: f64 = 6.0;
/// Searches from the limit that the one before ran into.
const SEARCHES: usize = 8;

/// What the motion is later than the effort of the same row, samples, with its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Delay {
    /// Delay of the motion behind the effort, samples.
    pub samples: f64,
    /// Its standard error, samples.
    pub error: f64,
}

/// Delay of a log as identification finds it, looked for around `start` (samples); `None` where it cannot be told.
///
/// # Errors
/// [`Error`] where the log cannot be prepared.
pub(super) fn find(
    settings: &Settings,
    bench: &Bench,
    loaded: &Log,
    start: f64,
) -> Result<Option<Delay>, Error> {
    if settings.conditioning.route == Route::Textbook {
        return Ok(None);
    }
    let settings = ConditioningSettings { delay_samples: None, ..settings.conditioning_settings() };
    let prepared = loaded.prepare(&bench.model, &settings)?;
    // What belongs to single logs repeats other columns within a log.
    let own = bench.model.log_columns();
    let kept: Vec<usize> = bench.base.kept.iter().copied().filter(|c| !own.contains(c)).collect();
    let mut samples = start;
    for _ in 0..SEARCHES {
        let log = moved(&prepared, samples)?;
        let Ok(found) = condition(&bench.model, &bench.shape, &kept, &[log], &settings, &mut |_| {}) else {
            return Ok(None);
        };
        samples += found.delay.samples;
        if !found.delay.at_limit {
            return Ok(Some(Delay { samples, error: found.delay.half_width / 1.96 }));
        }
    }
    Ok(None)
}

/// The log with its efforts moved to the motion that they belong to.
fn moved(log: &PreparedLog, samples: f64) -> Result<PreparedLog, Error> {
    let mut out = log.clone();
    for effort in out.effort.iter_mut().filter(|_| samples != 0.0) {
        let shifted = shift(effort, -samples).map_err(|e| Error::Conditioning(e.into()))?;
        *effort = shifted.values.into();
        out.usable.iter_mut().enumerate().for_each(|(k, usable)| *usable &= shifted.valid.contains(&k));
    }
    Ok(out)
}

/// `stated`: by the configuration, which is then what is expected.
pub(super) fn judge(found: Delay, stated: Option<f64>, rate_hz: f64, out: &mut Findings<'_>) {
    let (low, high) = stated.map_or(ORDINARY, |d| (d - AS_STATED, d + AS_STATED));
    let beyond = (found.samples - high).max(low - found.samples);
    if beyond <= 0.0 || beyond < SURE * found.error {
        return;
    }
    let evidence = format!(
        "the motion follows the effort of the same row by {:.2} ± {:.2} samples ({:.1} ms)",
        found.samples,
        found.error,
        1e3 * found.samples / rate_hz
    );
    let by_itself = (FOUND_BY_ITSELF.1 * rate_hz).max(FOUND_BY_ITSELF.0);
    let fix = vec![Fix::Delay(found.samples)];
    if stated.is_none() && found.samples > -2.0 && found.samples < by_itself {
        let remedy = "nothing: identification finds and removes a delay of this size";
        out.add(FindingId::Delay, Severity::Info, None, evidence, remedy).fixes = fix;
    } else {
        let remedy = "state the delay (`conditioning.delay_samples`), or log motion and effort by one clock";
        out.add(FindingId::Delay, Severity::Warning, None, evidence, remedy).fixes = fix;
    }
}
