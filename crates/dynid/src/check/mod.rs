//! Pre-flight of logs: what is wrong with them before anything is identified.
//!
//! [`check`] looks at the record alone (clock, repetitions, frozen and cut-off signals, spikes, velocities) and tries the
//! robot's model on it: columns in other orders, with other signs and units, the delay between effort and motion, the
//! direction of gravity, the excitation of the parameters. Every [`Finding`] has its evidence in numbers and a remedy;
//! [`Check::corrected`] writes the configuration that applies the remedies.

mod assignment;
mod bench;
mod columns;
mod delay;
mod finding;
mod fix;
mod plausibility;
mod record;
mod report;

use std::path::Path;

use dynid_io::ReadingNote;
use rayon::prelude::*;
use serde::Serialize;

use crate::Error;
use crate::config::{Config, LogConfig};
use crate::estimate::InputRecord;
use crate::logs::{self, LoadedLog};
use crate::overlap::{Overlap, Overlaps};
use crate::robot::{Robot, RobotOptions};
use bench::{Bench, Examined};
pub use finding::{Finding, FindingId, Severity};
use finding::{Findings, Fix};

/// What was measured of one log, whether or not it is a fault.
#[derive(Debug, Clone, PartialEq, Serialize)]
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

/// Outcome of [`check`].
#[derive(Debug, Clone, Serialize)]
pub struct Check {
    /// Robot file.
    pub robot: String,
    /// What was found, errors first, in the order of the logs.
    pub findings: Vec<Finding>,
    /// What was measured.
    pub logs: Vec<CheckedLog>,
    #[serde(skip)]
    traces: Vec<report::Trace>,
    /// Per log: its columns and the joints that are logged.
    #[serde(skip)]
    mapped: Vec<fix::Mapped>,
    #[serde(skip)]
    inputs: Vec<InputRecord>,
}

impl Check {
    /// The worst severity found.
    pub fn worst(&self) -> Option<Severity> {
        self.findings.iter().map(|f| f.severity).max()
    }

    /// Findings of one log.
    pub fn of_log<'a>(&'a self, log: &'a str) -> impl Iterator<Item = &'a Finding> {
        self.findings.iter().filter(move |f| f.log == log)
    }

    /// The result as JSON.
    pub fn to_json(&self) -> String {
        let value = serde_json::to_value(self).unwrap_or_default();
        serde_json::to_string_pretty(&value).unwrap_or_default()
    }
}

/// Examines all logs of a configuration, validation logs too. `progress` is told the file that is being examined.
///
/// # Errors
/// Bad input: files that cannot be read, columns that cannot be assigned. What is wrong with the numbers is a finding.
pub fn check(config: &Config, progress: &mut dyn FnMut(&str)) -> Result<Check, Error> {
    config.check()?;
    config.demand_inputs()?;
    let options = RobotOptions {
        gravity: config.gravity,
        couple_mimics: config.couple_mimics.unwrap_or(false),
        floating_base: false,
        locked: config.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
    };
    let robot = Robot::load(&config.robot, &options)?.with_registry(config.registry.clone());
    let mut out = Check {
        robot: config.robot.display().to_string(),
        findings: Vec::new(),
        logs: Vec::new(),
        traces: Vec::new(),
        mapped: Vec::new(),
        inputs: InputRecord::of_robot(&robot),
    };
    let mut bench: Option<(Vec<String>, Bench)> = None;
    let training = config.training_logs();
    let mut read: Vec<LoadedLog> = Vec::new();
    for log in training.iter().chain(&config.validation) {
        let file = log.path.display().to_string();
        progress(&file);
        let loaded = logs::load_as_it_is(log, &robot.axes, &config.columns, config.motor_side.as_ref())?;
        if bench.as_ref().is_none_or(|(still, _)| *still != loaded.not_logged) {
            let still: Vec<(String, f64)> = loaded.not_logged.iter().map(|n| (n.clone(), 0.0)).collect();
            let held = if still.is_empty() { robot.clone() } else { robot.locked(&still)? };
            bench = Some((loaded.not_logged.clone(), Bench::new(config, &held)?));
        }
        let Some((_, bench)) = &bench else { continue };
        let mut findings = Findings { log: &file, number: out.logs.len(), list: Vec::new() };
        let (mut checked, trace) = examine(config, &loaded, bench, &mut findings)?;
        if let Some(found) = late(config, &loaded, bench, &checked, &mut findings)? {
            checked.delay_samples = Some([found.samples, found.error]);
        }
        out.inputs.extend(InputRecord::of_logs(std::slice::from_ref(&loaded)));
        out.findings.extend(findings.list);
        out.logs.push(checked);
        out.traces.push(trace);
        out.mapped.push(fix::Mapped { columns: loaded.mapping.clone(), joints: bench.names() });
        read.push(loaded);
    }
    let overlaps = Overlaps::of(&read[..training.len()], &read[training.len()..]);
    out.findings.extend(repeated(&overlaps));
    out.findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    Ok(out)
}

/// Examines logs that were read already. `robot`: joints that are not logged are locked.
pub(crate) fn of_loaded(
    config: &Config,
    robot: &Robot,
    loaded: &[LoadedLog],
    overlaps: &Overlaps,
) -> Result<Vec<Finding>, Error> {
    let bench = Bench::new(config, robot)?;
    let training = config.training_logs();
    let logs: Vec<_> = loaded.iter().zip(&training).enumerate().collect();
    let of_log = |(number, (log, entry)): &(usize, (&LoadedLog, &LogConfig))| {
        let file = entry.path.display().to_string();
        let mut findings = Findings { log: &file, number: *number, list: Vec::new() };
        examine(config, log, &bench, &mut findings)?;
        Ok(findings.list)
    };
    let mut out = logs.par_iter().map(of_log).collect::<Result<Vec<_>, Error>>()?.concat();
    out.extend(repeated(overlaps).into_iter().filter(|f| f.number < loaded.len()));
    Ok(out)
}

/// Logs that are no recordings of their own.
fn repeated(overlaps: &Overlaps) -> Vec<Finding> {
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
fn late(
    config: &Config,
    loaded: &LoadedLog,
    bench: &Bench,
    checked: &CheckedLog,
    out: &mut Findings<'_>,
) -> Result<Option<delay::Delay>, Error> {
    let spoilt = out.list.iter().any(|f| f.severity == Severity::Error && f.id != FindingId::Delay.name());
    if spoilt || checked.unexplained.is_none_or(|share| share > bench::UNEXPLAINED) {
        return Ok(None);
    }
    let stated = config.conditioning.delay_samples;
    let long = out.list.iter_mut().flat_map(|f| &mut f.fixes).find_map(|fix| match fix {
        Fix::Delay(samples) => Some(samples),
        _ => None,
    });
    let start = long.as_ref().map_or(stated.unwrap_or(0.0), |samples| **samples);
    let found = delay::find(config, bench, loaded, start)?;
    match (found, long) {
        (Some(found), Some(long)) => *long = found.samples,
        (Some(found), None) => delay::judge(found, stated, checked.rate_hz, out),
        (None, _) => {}
    }
    Ok(found)
}

fn examine(
    config: &Config,
    loaded: &LoadedLog,
    bench: &Bench,
    out: &mut Findings<'_>,
) -> Result<(CheckedLog, report::Trace), Error> {
    if let Some(tree) = bench.tree() {
        assignment::examine(config, tree, &loaded.mapping, out);
    }
    for turns in &loaded.unwrapped {
        let remedy = "nothing: the position was unwrapped; see that the logger keeps turns apart where a joint has limits";
        out.add(FindingId::PositionWrap, Severity::Info, Some(&turns.joint), turns.words(), remedy);
    }
    let mut on_grid = record::examine(&loaded.log, &loaded.rows, |joint| bench.drives(joint), out)?;
    bench.order(&mut on_grid);
    let idle = bench.idle(&loaded.log, out);
    let Examined { wiring, tilt, excitation } = bench.examine(&on_grid, &idle, out)?;
    let checked = CheckedLog {
        log: out.log.to_owned(),
        reading: loaded.reading.clone(),
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
    Ok((checked, report::Trace::of(&on_grid)))
}

/// Name of a file without its folders.
fn short(path: &str) -> String {
    Path::new(path).file_name().map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}
