//! `dynid identify`.

use std::path::{Path, PathBuf};

use dynid::config::{Config, Consistency, Friction, LogConfig, Method, Route};
use dynid::estimate::{Estimate, LogScale, ShapeValue};
use dynid::{Error, identify};

use super::{apply_log_args_to, element_names, export, table};
use crate::args::{ConsistencyArg, FrictionArg, IdentifyArgs, MethodArg, RouteArg};
use crate::message::{Failure, data, note};
use crate::outputs;
use crate::progress::Progress;

const DEFAULT_OUT: &str = "dynid-out";

pub(crate) fn run(args: &IdentifyArgs) -> Result<u8, Failure> {
    let config = configuration(args)?;
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let robot = config.robot.file_stem().map_or_else(|| "robot".into(), |s| s.to_string_lossy().into_owned());
    let urdf_name = format!("{robot}.urdf");
    let names = ["estimate.json", "report.html", &urdf_name, &format!("{robot}.loops.toml")];
    let files = names.map(|name| out.join(name));
    let logs = config.log.iter().chain(&config.validation).map(|log| log.path.as_path());
    let friction = config.elements.known_friction.as_deref();
    let inputs: Vec<&Path> = logs.chain([args.input.as_path(), &config.robot]).chain(friction).collect();
    let set = outputs::prepare_folder(&files, &inputs)?;
    let progress = Progress::new(args.quiet);
    let identification = identify(&config, &mut |step| progress.step(step))?;
    let mut estimate = identification.estimate(&config)?;
    estimate.provenance.command_line =
        std::env::args_os().map(|a| a.to_string_lossy().into_owned()).collect();
    estimate.provenance.revision = option_env!("DYNID_REVISION").map(str::to_owned);
    let report = identification.report(&config, &estimate)?;
    let urdf = match identification.urdf() {
        Ok(exported) => Ok(exported),
        // What a URDF cannot state is no reason to lose the identification.
        Err(reason @ (Error::RobotFile(_) | Error::Export(_))) => Err(reason),
        Err(error) => return Err(error.into()),
    };
    drop(progress);

    let loops = if urdf.is_ok() { identification.loops(&urdf_name)? } else { None };
    let texts =
        [Some(&estimate.to_json()), Some(&report), urdf.as_ref().ok().map(|u| &u.text), loops.as_ref()];
    for (number, text) in texts.into_iter().enumerate() {
        text.map(|text| set.write(number, text.as_bytes())).transpose()?;
    }
    let written = set.publish()?;
    let failed = estimate.verdict.status == "fail";
    if !args.quiet {
        summary(&estimate, written.iter().map(PathBuf::as_path));
    } else if failed {
        note(&verdict(&estimate));
    }
    if !args.quiet || urdf.is_err() {
        export::tell(&files[2], &urdf, &estimate);
    }
    if args.json {
        data(&estimate.to_json())?;
    }
    Ok(u8::from(failed))
}

/// The configuration file with flags over it, or one made of flags alone.
fn configuration(args: &IdentifyArgs) -> Result<Config, Failure> {
    let plain = |path: &Path| LogConfig { path: path.to_owned(), ..LogConfig::default() };
    let mut config = if args.log.is_empty() {
        Config::read(&args.input).map_err(|error| match dynid::io::robot::read(&args.input) {
            Ok(_) => Failure::Usage(
                format!(
                    "{}: expected a configuration, found a robot file without --log",
                    args.input.display()
                ),
                "add --log LOG, or give a configuration",
            ),
            Err(_) => error.into(),
        })?
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
        config.elements.default = element_names(args.elements.as_deref());
    }
    if let Some(friction) = args.friction {
        config.elements.friction = match friction {
            FrictionArg::Auto => Friction::Auto,
            FrictionArg::Given => Friction::Given,
            FrictionArg::Linear => Friction::Linear,
            FrictionArg::Asymmetric => Friction::Asymmetric,
            FrictionArg::Arctangent => Friction::Arctangent,
            FrictionArg::Stribeck => Friction::Stribeck,
            FrictionArg::Tanh => Friction::Tanh,
            FrictionArg::Sigmoid => Friction::Sigmoid,
            FrictionArg::SigmoidOffset => Friction::SigmoidOffset,
            FrictionArg::Power => Friction::Power,
        };
    }
    if args.known_friction.is_some() {
        config.elements.known_friction.clone_from(&args.known_friction);
    }
    apply_log_args_to(&mut config, &args.columns);
    config.locked.extend(args.lock.iter().cloned());
    if args.couple_mimics {
        config.couple_mimics = Some(true);
    }
    config.gravity = args.gravity.or(config.gravity);
    config.known_effort_scale |= args.known_effort_scale;
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
        Some(MethodArg::Huber) => config.estimator.method = Method::Huber,
        Some(MethodArg::Tukey) => config.estimator.method = Method::Tukey,
        Some(MethodArg::Ridge) => config.estimator.method = Method::Ridge,
        None => {}
    }
    if args.search.is_some() {
        config.estimator.shape.search.clone_from(&args.search);
    }
    match args.consistency {
        Some(ConsistencyArg::PseudoInertia) => config.estimator.consistency = Consistency::PseudoInertia,
        Some(ConsistencyArg::SpatialInertia) => config.estimator.consistency = Consistency::SpatialInertia,
        Some(ConsistencyArg::None) => config.estimator.consistency = Consistency::None,
        None => {}
    }
    c.kernel_hz = args.kernel_hz.or(c.kernel_hz);
    c.state_hz = args.state_hz.or(c.state_hz);
    c.delay_samples = args.delay_samples.or(c.delay_samples);
    c.reversal_mask = args.reversal_mask.or(c.reversal_mask);
    c.decimation = args.decimation.or(c.decimation);
    Ok(config)
}

fn summary<'a>(estimate: &Estimate, files: impl Iterator<Item = &'a Path>) {
    for warning in &estimate.verdict.warnings {
        note(&format!("warning: {warning}"));
    }
    note("settings:");
    for choice in &estimate.conditioning.choices {
        let value = match &choice.value {
            serde_json::Value::Number(n) => table::number(n.as_f64()),
            serde_json::Value::Null => {
                note(&format!("  {} = none ({}: {})", choice.name, choice.origin, choice.reason));
                continue;
            }
            serde_json::Value::Array(list) if list.is_empty() => "none".to_owned(),
            serde_json::Value::Array(list) => {
                let word = |x: &serde_json::Value| x.as_str().map(str::to_owned);
                let words = list.iter().map(|x| word(x).unwrap_or_else(|| table::number(x.as_f64())));
                words.collect::<Vec<_>>().join(" ")
            }
            serde_json::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        note(&format!("  {} = {value} {} ({}: {})", choice.name, choice.unit, choice.origin, choice.reason));
    }
    note(&format!(
        "\ntraining fit (filtered at {:.1} Hz, relative error {} %):",
        estimate.fit.filter_hz,
        table::number(estimate.fit.filtered.relative_error)
    ));
    let fit = &estimate.fit;
    note(table::agreement(&estimate.joints, &fit.raw, &fit.filtered, &fit.by_motion).trim_end());
    for fit in &estimate.validation {
        note(&format!(
            "\nvalidation on {} (filtered at {:.1} Hz, relative error {} %):",
            fit.log,
            fit.filter_hz,
            table::number(fit.filtered.relative_error)
        ));
        note(table::agreement(&estimate.joints, &fit.raw, &fit.filtered, &fit.by_motion).trim_end());
    }
    note("\nchecks:");
    for check in &estimate.verdict.checks {
        let value =
            check.value.map_or_else(String::new, |v| format!("{} {}", table::number(Some(v)), check.unit));
        let value = value.trim_end();
        note(&format!("  [{}] {}: {value} ({}): {}", check.status, check.name, check.limit, check.meaning));
    }
    let count = |verdict: &str| estimate.parameters.iter().filter(|p| p.verdict == verdict).count();
    note(&format!(
        "\nparameters: {} of {} seen in the data, {} carried by the prior, {} not identifiable (one by one in the report)",
        count("seen in the data"),
        estimate.parameters.len(),
        count("carried by the prior"),
        count("not identifiable"),
    ));
    for shape in &estimate.shape_parameters {
        note(&format!("  {}", shape_parameter(shape)));
    }
    for scale in &estimate.log_scales {
        note(&format!("  {}", log_scale(scale)));
    }
    for motion in &estimate.motions_that_would_help {
        note(&format!("  {motion}"));
    }
    note(&format!("\n{}", verdict(estimate)));
    for file in files {
        note(&format!("written: {}", file.display()));
    }
}

/// A parameter that enters nonlinearly: value, interval, verdict with its reason.
fn shape_parameter(shape: &ShapeValue) -> String {
    let of = format!("{} = {} {}", shape.name, table::number(Some(shape.value)), shape.unit);
    judged(&of, shape.interval, &shape.verdict, shape.reason.as_deref())
}

/// Friction of a log over that of the others.
fn log_scale(scale: &LogScale) -> String {
    let of =
        format!("friction in {} = {} of that in the others", scale.log, table::number(Some(scale.value)));
    judged(&of, scale.interval, &scale.verdict, scale.reason.as_deref())
}

fn judged(of: &str, interval: Option<(f64, f64)>, verdict: &str, reason: Option<&str>) -> String {
    let number = |x: f64| table::number(Some(x));
    let interval = interval
        .map_or_else(String::new, |(low, high)| format!(" (95 %: {} to {})", number(low), number(high)));
    let reason = reason.map_or_else(String::new, |r| format!(", {r}"));
    format!("{of}{interval}: {verdict}{reason}")
}

fn verdict(estimate: &Estimate) -> String {
    format!("{}: {}", estimate.verdict.status, estimate.verdict.headline)
}
