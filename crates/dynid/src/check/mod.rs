//! Pre-flight of logs: what is wrong with them before anything is identified.
//!
//! [`check`] reads the logs of a configuration and examines them ([`crate::preflight`]); [`Check::corrected`] writes the configuration
//! that applies the remedies.

mod fix;
mod report;

use serde::Serialize;

use crate::config::Config;
use crate::estimate::InputRecord;
use crate::log::Log;
use crate::overlap::Overlaps;
use crate::preflight::{Bench, CheckedLog, Findings, examine, late, repeated};
pub use crate::preflight::{Finding, FindingId, Severity};
use crate::{Error, logs};

/// Outcome of [`check`].
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
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
    let robot = config.read_robot()?;
    let settings = config.settings()?;
    let mut out = Check {
        robot: config.robot.display().to_string(),
        findings: Vec::new(),
        logs: Vec::new(),
        traces: Vec::new(),
        mapped: Vec::new(),
        inputs: robot.inputs(),
    };
    let mut bench: Option<(Vec<String>, Bench)> = None;
    let training = config.training_logs();
    let mut read: Vec<Log> = Vec::new();
    for log in training.iter().chain(&config.validation) {
        let file = log.path.display().to_string();
        progress(&file);
        let loaded = logs::load_as_it_is(log, &robot.axes, &config.columns, config.motor_side.as_ref())?;
        let not_logged = loaded.not_logged(&robot.axes);
        if bench.as_ref().is_none_or(|(still, _)| *still != not_logged) {
            let still: Vec<(String, f64)> = not_logged.iter().map(|n| (n.clone(), 0.0)).collect();
            let held = if still.is_empty() { robot.clone() } else { robot.locked(&still)? };
            bench = Some((not_logged, Bench::new(&settings, &held)?));
        }
        let Some((_, bench)) = &bench else { continue };
        let mut findings = Findings { log: &file, number: out.logs.len(), list: Vec::new() };
        let (mut checked, on_grid) = examine(&loaded, bench, &mut findings)?;
        if let Some(found) = late(&settings, &loaded, bench, &checked, &mut findings)? {
            checked.delay_samples = Some([found.samples, found.error]);
        }
        out.inputs.extend(loaded.source.inputs.iter().cloned());
        out.findings.extend(findings.list);
        out.logs.push(checked);
        out.traces.push(report::Trace::of(&on_grid));
        out.mapped.push(fix::Mapped { columns: logs::mapping_of(&loaded).clone(), joints: bench.names() });
        read.push(loaded);
    }
    let overlaps = Overlaps::of(&read[..training.len()], &read[training.len()..]);
    out.findings.extend(repeated(&overlaps));
    out.findings.sort_by_key(|f| std::cmp::Reverse(f.severity));
    Ok(out)
}
