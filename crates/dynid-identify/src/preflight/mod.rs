//! Pre-flight of logs: what is wrong with them before anything is identified.
//!
//! It looks at the record alone (clock, repetitions, frozen and cut-off signals, spikes, velocities) and tries the robot's model on it:
//! columns in other orders, with other signs and units, the delay between effort and motion, the direction of gravity, the excitation
//! of the parameters. Every [`Finding`] has its evidence in numbers and a remedy.

mod assignment;
mod bench;
mod columns;
mod delay;
mod examine;
mod plausibility;
mod record;

use dynid_logs::ReadingNote;
use dynid_motion::UniformLog;
use rayon::prelude::*;
use serde::Serialize;

use crate::Error;
pub use crate::finding::{Finding, FindingId, Findings, Fix, Severity};
use crate::log::Log;
use crate::overlap::{Overlap, Overlaps};
use crate::settings::Settings;
pub use bench::Bench;
pub use delay::Delay;
use examine::Examined;

/// What was measured of one log, whether or not it is a fault.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct CheckedLog {
    /// Log file.
    pub log: String,
    /// How the file was read where that was found out: format, decimal mark, unit of the time, rows without a value.
    pub reading: Vec<ReadingNote>,
    /// Rows.
    pub rows: usize,
    /// Sample rate, Hz.
    pub rate_hz: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Standard deviation of the clock's steps, samples.
    pub jitter: f64,
    /// Share of the efforts (root mean square, over all joints) that the best trial model leaves unexplained.
    pub unexplained: Option<f64>,
    /// Delay of the motion behind the effort with its standard error, samples.
    pub delay_samples: Option<[f64; 2]>,
    /// Angle of gravity to the direction stated with its standard error, degrees.
    pub tilt_deg: Option<[f64; 2]>,
    /// Condition number of the weighted regressor with unit columns.
    pub condition: Option<f64>,
    /// Base parameters that the log excites, of all.
    pub excited: Option<[usize; 2]>,
}

/// Examines logs. `bench`: of the robot with joints that are not logged locked.
pub fn of_logs(bench: &Bench, logs: &[Log], overlaps: &Overlaps) -> Result<Vec<Finding>, Error> {
    let of_log = |(number, log): (usize, &Log)| {
        let mut findings = Findings { log: log.log.name(), number, list: Vec::new() };
        examine(log, bench, &mut findings)?;
        Ok(findings.list)
    };
    let mut out = logs.par_iter().enumerate().map(of_log).collect::<Result<Vec<_>, Error>>()?.concat();
    out.extend(repeated(overlaps).into_iter().filter(|f| f.number < logs.len()));
    Ok(out)
}

/// Logs that are no recordings of their own.
pub fn repeated(overlaps: &Overlaps) -> Vec<Finding> {
    let finding = |overlap: &Overlap, severity, remedy: &str, fixes| {
        let mut findings = Findings { log: &overlap.log, number: overlap.number, list: Vec::new() };
        findings.add(FindingId::RepeatedLog, severity, None, overlap.words(), remedy).fixes = fixes;
        findings.list
    };
    let training = overlaps.training.iter().flat_map(|o| {
        let remedy = "leave out one of the two: rows that count twice make intervals too narrow";
        match o.repeats() {
            true => finding(o, Severity::Error, remedy, vec![Fix::Drop]),
            false => finding(o, Severity::Warning, remedy, Vec::new()),
        }
    });
    let validation = overlaps.validation.iter().flat_map(|o| {
        let remedy = "validate on a recording of its own: the model was fitted to these rows";
        finding(o, Severity::Warning, remedy, Vec::new())
    });
    training.chain(validation).collect()
}

/// The delay of a log that is read as it should be. Identification, which finds it itself, does not ask for it twice.
pub fn late(
    settings: &Settings,
    loaded: &Log,
    bench: &Bench,
    checked: &CheckedLog,
    out: &mut Findings<'_>,
) -> Result<Option<delay::Delay>, Error> {
    let spoilt = out.list.iter().any(|f| f.severity == Severity::Error && f.id != FindingId::Delay);
    if spoilt || checked.unexplained.is_none_or(|share| share > bench::UNEXPLAINED) {
        return Ok(None);
    }
    let stated = settings.conditioning.delay_samples;
    let long = out.list.iter_mut().flat_map(|f| &mut f.fixes).find_map(|fix| match fix {
        Fix::Delay(samples) => Some(samples),
        _ => None,
    });
    let start = long.as_ref().map_or(stated.unwrap_or(0.0), |samples| **samples);
    let found = delay::find(settings, bench, loaded, start)?;
    match (found, long) {
        (Some(found), Some(long)) => *long = found.samples,
        (Some(found), None) => delay::judge(found, stated, checked.rate_hz, out),
        (None, _) => {}
    }
    Ok(found)
}

/// Examines one log as it is; `out` takes what is found. Also returns its signals on a uniform grid.
///
/// # Errors
/// What keeps a model from being tried at all: settings, signals that cannot be filtered.
pub fn examine(
    loaded: &Log,
    bench: &Bench,
    out: &mut Findings<'_>,
) -> Result<(CheckedLog, UniformLog), Error> {
    if let Some(tree) = bench.tree() {
        assignment::examine(tree, &loaded.source, out);
    }
    for turns in &loaded.unwrapped {
        let remedy = "nothing: the position was unwrapped; see that the logger keeps turns apart where a joint has limits";
        out.add(FindingId::PositionWrap, Severity::Info, Some(&turns.joint), turns.words(), remedy);
    }
    let mut on_grid = record::examine(&loaded.log, &loaded.data_rows(), |joint| bench.drives(joint), out)?;
    bench.order(&mut on_grid);
    let idle = bench.idle(&loaded.log, out);
    let Examined { wiring, tilt, excitation } = bench.examine(&on_grid, &idle, out)?;
    let checked = CheckedLog {
        log: out.log.to_owned(),
        reading: loaded.source.notes.clone(),
        rows: loaded.log.rows(),
        rate_hz: on_grid.rate_hz,
        duration_s: on_grid.samples() as f64 / on_grid.rate_hz,
        jitter: on_grid.report.jitter,
        unexplained: wiring.as_ref().map(|w| (w.misfit() / w.nothing).sqrt()),
        delay_samples: None,
        tilt_deg: tilt.map(|t| [t.angle.to_degrees(), t.error.to_degrees()]),
        condition: excitation.as_ref().map(|e| e.condition),
        excited: excitation.as_ref().map(|e| [e.excited, bench.parameters()]),
    };
    Ok((checked, on_grid))
}
