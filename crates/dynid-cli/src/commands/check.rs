//! `dynid check`.

use std::path::Path;

use dynid::check::{Check, Finding, Severity, check};
use dynid::config::{Config, LogConfig};

use super::apply_log_args_to;
use crate::args::CheckArgs;
use crate::message::{Failure, data, note};
use crate::outputs;
use crate::progress::Progress;

pub(crate) fn run(args: &CheckArgs) -> Result<u8, Failure> {
    let (mut config, source) = configuration(args)?;
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
    let set = outputs::prepare_files(&outputs, &inputs)?;
    let progress = Progress::new(args.quiet);
    let found = check(&config, &mut |log| progress.examining(log))?;
    drop(progress);
    for (number, (argument, _)) in outputs.iter().enumerate() {
        let text = match *argument {
            "--fix" => found.corrected(&config, source)?,
            _ => found.report()?,
        };
        set.write(number, text.as_bytes())?;
    }
    set.publish()?;
    if args.json {
        data(&(found.to_json() + "\n"))?;
    } else {
        data(&text(&found))?;
    }
    if !args.quiet {
        for path in [&args.report, &args.fix].into_iter().flatten() {
            note(&format!("written: {}", path.display()));
        }
    }
    Ok(u8::from(found.worst() == Some(Severity::Error)))
}

/// The configuration to examine, and the file that it comes from.
fn configuration(args: &CheckArgs) -> Result<(Config, Option<&Path>), Failure> {
    let plain = |path: &std::path::PathBuf| LogConfig { path: path.clone(), ..LogConfig::default() };
    match (&args.robot, args.input.as_slice()) {
        (Some(robot), logs) => {
            let log = logs.iter().map(plain).collect();
            Ok((Config { robot: robot.clone(), log, ..Config::default() }, None))
        }
        (None, [config]) if config.extension().is_some_and(|e| e == "toml") => {
            Ok((Config::read(config)?, Some(config)))
        }
        (None, _) => Err(Failure::Usage(
            "expected a robot file for these logs, found none".to_owned(),
            "add --robot ROBOT, or give a configuration (TOML)",
        )),
    }
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
