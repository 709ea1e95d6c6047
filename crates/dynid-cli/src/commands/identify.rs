//! `dynid identify`.

use std::path::{Path, PathBuf};

use dynid::config::{Config, LogConfig, Method, Route};
use dynid::estimate::Estimate;
use dynid::io::output::write_atomically;
use dynid::{Error, identify};

use super::{apply_log_args, table};
use crate::args::{IdentifyArgs, MethodArg, RouteArg};
use crate::message::{Failure, data, note};
use crate::progress::Progress;

const DEFAULT_OUT: &str = "dynid-out";

pub(crate) fn run(args: &IdentifyArgs) -> Result<u8, Failure> {
    let config = configuration(args)?;
    let progress = Progress::new(args.quiet);
    let identification = identify(&config, |step| progress.step(step))?;
    let estimate = identification.estimate(&config)?;
    let report = identification.report(&config, &estimate)?;
    let urdf = identification.urdf()?;
    drop(progress);

    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    std::fs::create_dir_all(&out).map_err(|source| Error::Read { file: out.clone(), source })?;
    let robot = config.robot.file_stem().map_or_else(|| "robot".into(), |s| s.to_string_lossy().into_owned());
    let files = [
        (out.join("estimate.json"), estimate.to_json()),
        (out.join("report.html"), report),
        (out.join(format!("{robot}.urdf")), urdf),
    ];
    for (path, text) in &files {
        write_atomically(path, text.as_bytes())?;
    }
    if !args.quiet {
        summary(&estimate, &files.map(|(path, _)| path));
    }
    if args.json {
        data(&estimate.to_json())?;
    }
    Ok(if estimate.verdict.status == "fail" { 1 } else { 0 })
}

/// The configuration file with flags over it, or one made of flags alone.
fn configuration(args: &IdentifyArgs) -> Result<Config, Failure> {
    let plain = |path: &Path| LogConfig { path: path.to_owned(), ..LogConfig::default() };
    let mut config = if args.log.is_empty() {
        let name = args.input.display();
        let extension = args.input.extension().map(|e| e.to_string_lossy().to_lowercase());
        if matches!(extension.as_deref(), Some("urdf" | "xml")) {
            return Err(Failure::Usage(format!("{name} is a robot file: add --log LOG, or give a configuration")));
        }
        Config::read(&args.input)?
    } else {
        Config {
            robot: args.input.clone(),
            log: args.log.iter().map(|p| plain(p)).collect(),
            ..Config::default()
        }
    };
    config.validation.extend(args.validate.iter().map(|p| plain(p)));
    if args.out.is_some() {
        config.out.clone_from(&args.out);
    }
    if args.elements.is_some() {
        config.elements.default.clone_from(&args.elements);
    }
    apply_log_args(&mut config.columns, &args.columns);
    config.locked.extend(args.lock.iter().cloned());
    if args.couple_mimics {
        config.couple_mimics = Some(true);
    }
    config.gravity = args.gravity.or(config.gravity);
    config.seed = args.seed.or(config.seed);
    config.preferred.extend(args.prefer.iter().cloned());
    let c = &mut config.conditioning;
    match args.route {
        Some(RouteArg::Compact) => c.route = Route::Compact,
        Some(RouteArg::Textbook) => c.route = Route::Textbook,
        None => {}
    }
    match args.estimator {
        Some(MethodArg::Ols) => config.estimator.method = Method::Ols,
        Some(MethodArg::Wls) => config.estimator.method = Method::Wls,
        None => {}
    }
    c.kernel_hz = args.kernel_hz.or(c.kernel_hz);
    c.state_hz = args.state_hz.or(c.state_hz);
    c.delay_samples = args.delay_samples.or(c.delay_samples);
    c.reversal_mask = args.reversal_mask.or(c.reversal_mask);
    c.decimation = args.decimation.or(c.decimation);
    Ok(config)
}

fn summary(estimate: &Estimate, files: &[PathBuf]) {
    for warning in &estimate.verdict.warnings {
        note(&format!("warning: {warning}"));
    }
    note("settings:");
    for choice in &estimate.conditioning.choices {
        let value = match &choice.value {
            serde_json::Value::Number(n) => table::number(n.as_f64()),
            serde_json::Value::Null => "none".to_owned(),
            serde_json::Value::Array(list) => {
                list.iter().map(|x| table::number(x.as_f64())).collect::<Vec<_>>().join(" ")
            }
            other => other.to_string(),
        };
        note(&format!("  {} = {value} {} ({}: {})", choice.name, choice.unit, choice.origin, choice.reason));
    }
    note(&format!(
        "\ntraining fit (filtered at {:.1} Hz, relative error {} %):",
        estimate.fit.filter_hz,
        table::number(estimate.fit.filtered.relative_error)
    ));
    note(table::agreement(&estimate.joints, &estimate.fit.raw, &estimate.fit.filtered).trim_end());
    for fit in &estimate.validation {
        note(&format!(
            "\nvalidation on {} (filtered at {:.1} Hz, relative error {} %):",
            fit.log,
            fit.filter_hz,
            table::number(fit.filtered.relative_error)
        ));
        note(table::agreement(&estimate.joints, &fit.raw, &fit.filtered).trim_end());
    }
    note("\nchecks:");
    for check in &estimate.verdict.checks {
        let value = check.value.map_or_else(String::new, |v| format!(" {} {}", table::number(Some(v)), check.unit));
        note(&format!("  [{}] {}:{} ({}): {}", check.status, check.name, value, check.limit, check.meaning));
    }
    note(&format!("\n{}: {}", estimate.verdict.status, estimate.verdict.headline));
    for file in files {
        note(&format!("written: {}", file.display()));
    }
}
