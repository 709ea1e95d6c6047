//! `dynid check`.

use std::path::Path;

use dynid::check::{Check, Finding, Severity, check};
use dynid::config::{Config, is_configuration};
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs::{self, marked_toml};
use dynid_terminal::progress::Progress;

use super::run::{GivenLogs, configuration as run_configuration};
use super::{apply_log_args_to, demand_stdout, result};
use crate::args::CheckArgs;

pub(crate) fn run(args: &CheckArgs) -> Result<u8, Failure> {
    let notes = Notes::new(args.print.quiet);
    let (mut config, source) = configuration(args, notes)?;
    apply_log_args_to(&mut config, &args.columns);
    config.locked.extend(args.lock.iter().cloned());
    config.gravity = args.gravity.or(config.gravity);
    config.known_effort_scale |= args.known_effort_scale;
    let outputs: Vec<(&str, &Path)> = [("--fix", &args.fix), ("--report", &args.report)]
        .into_iter()
        .filter_map(|(name, path)| Some((name, path.as_deref()?)))
        .collect();
    let logs = config.log.iter().chain(&config.validation).map(|log| log.path.as_path());
    let inputs: Vec<&Path> = logs.chain(source).chain([config.robot.as_path()]).collect();
    let set = outputs::prepare_files(&outputs, &inputs, args.force)?;
    demand_stdout(args.print, &set)?;
    let progress = Progress::new(args.print.quiet);
    let found = check(&config, &mut |log| progress.doing(format!("examining {log}")))?;
    drop(progress);
    for (number, (argument, _)) in outputs.iter().enumerate() {
        let text = match *argument {
            "--fix" => marked_toml(&found.corrected(&config, source)?),
            _ => found.report()?,
        };
        set.write(number, text.as_bytes())?;
    }
    let taken = set.take_stdout();
    let written = set.publish()?;
    match args.print.json {
        true => data(&(found.to_json() + "\n"))?,
        false => result(&text(&found), taken, notes)?,
    }
    notes.written(&written);
    if !found.findings.is_empty() && !args.print.json {
        notes.tell("`dynid explain NAME` says what a finding means and what to do");
    }
    Ok(u8::from(found.worst() == Some(Severity::Error)))
}

/// The configuration to examine, and the file that it comes from.
fn configuration(args: &CheckArgs, notes: Notes) -> Result<(Config, Option<&Path>), Failure> {
    let logs = |paths| GivenLogs { paths, rows: args.rows };
    match (&args.robot, args.input.as_slice()) {
        (Some(_), _) if !args.log.is_empty() => Err(Failure::Usage(
            "--log: logs are named before --robot already".to_owned(),
            "`dynid check ROBOT --log LOG`, or `dynid check LOG --robot ROBOT`",
        )),
        (Some(robot), paths) if is_configuration(robot) => Err(Failure::Usage(
            format!("--robot: expected a robot file, found the configuration {}", robot.display()),
            match paths.len() {
                1 => "`dynid check CONFIG --log LOG`",
                _ => "`dynid check CONFIG --log LOG --log LOG`",
            },
        )),
        (Some(robot), paths) => Ok((run_configuration(robot, &logs(paths), notes)?, None)),
        (None, [input]) if is_configuration(input) => {
            Ok((run_configuration(input, &logs(&args.log), notes)?, Some(input)))
        }
        (None, [input]) if !args.log.is_empty() || !is_table(input) => {
            Ok((run_configuration(input, &logs(&args.log), notes)?, None))
        }
        (None, [config, ..]) if is_configuration(config) => Err(Failure::Usage(
            format!("expected one configuration, found {} files", args.input.len()),
            "name logs with --log: `dynid check CONFIG --log LOG`",
        )),
        (None, _) => Err(Failure::Usage(
            "expected a robot file for these logs, found none".to_owned(),
            "add --robot ROBOT, or give a configuration (TOML)",
        )),
    }
}

/// Whether a file is called as logs are.
fn is_table(path: &Path) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    [".csv", ".gz", ".txt", ".tsv", ".dat"].iter().any(|ending| name.ends_with(ending))
}

fn text(found: &Check) -> String {
    let mut out = String::new();
    let mut line = |text: String| out.push_str(&format!("{text}\n"));
    for log in &found.logs {
        let pair = |name: &str, pair: Option<[f64; 2]>, unit: &str| {
            pair.map(|[value, error]| format!("{name} {value:.2} ± {error:.2}{unit}"))
        };
        let facts = [
            Some(format!("{} rows at {:.4} Hz", log.rows, log.rate_hz)),
            log.unexplained.map(|u| format!("trial model leaves {:.2} % of the effort", 100.0 * u)),
            pair("delay", log.delay_samples, " samples"),
            pair("tilt", log.tilt_deg, "°"),
            log.condition.filter(|c| c.is_finite()).map(|c| format!("condition {c:.0}")),
            log.excited.map(|[seen, of]| format!("{seen} of {of} base parameters excited")),
        ];
        line(format!("{}: {}", log.log, facts.into_iter().flatten().collect::<Vec<_>>().join(", ")));
        for note in &log.reading {
            line(format!("  {}: {} ({})", note.setting, note.value, note.reason));
        }
        let mut own: Vec<&Finding> = found.findings.iter().filter(|f| f.log == log.log).collect();
        own.dedup();
        for finding in own {
            let severity = finding.severity.word();
            let joint = finding.joint.as_ref().map_or_else(String::new, |j| format!(" {j}"));
            line(format!("  [{severity}] {}{joint}: {}", finding.id, finding.evidence));
            line(format!("      remedy: {}", finding.remedy));
        }
    }
    line(found.headline());
    out
}
