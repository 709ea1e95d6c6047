//! `dynid identify`.

mod summary;

use std::path::{Path, PathBuf};

use dynid::config::{Config, Consistency, Friction, Method, Route};
use dynid::export::ExportError;
use dynid::record::Status;
use dynid::{Error, identify};

use super::run::{GivenLogs, configuration as run_configuration, plain};
use super::{apply_log_args_to, element_names, export};
use crate::args::{ConsistencyArg, FrictionArg, IdentifyArgs, MethodArg, RouteArg, command_line};
use dynid_terminal::message::{Failure, Notes, data};
use dynid_terminal::outputs::{self, marked_toml, marked_xml};
use dynid_terminal::progress::Progress;
pub(super) use summary::summary;

const DEFAULT_OUT: &str = "dynid-out";

pub(crate) fn run(args: &IdentifyArgs) -> Result<u8, Failure> {
    let notes = Notes::new(args.print.quiet);
    let config = configuration(args, notes)?;
    let out = config.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
    let stem = config.robot.file_stem().filter(|stem| *stem != "-");
    let robot = stem.map_or_else(|| "robot".into(), |s| s.to_string_lossy().into_owned());
    let urdf_name = format!("{robot}.urdf");
    let names = ["estimate.json", "report.html", &urdf_name, &format!("{robot}.loops.toml")];
    let files = names.map(|name| out.join(name));
    let logs = config.log.iter().chain(&config.validation).map(|log| log.path.as_path());
    let friction = config.elements.known_friction.as_deref();
    let inputs: Vec<&Path> = logs.chain([args.input.as_path(), &config.robot]).chain(friction).collect();
    let set = outputs::prepare_folder(&files, &inputs, args.force)?;
    let progress = Progress::new(args.print.quiet);
    let identification = identify(&config, &mut |step| progress.step(step))?;
    let mut estimate = identification.estimate();
    estimate.provenance.command_line = command_line();
    estimate.provenance.revision = option_env!("DYNID_REVISION").map(str::to_owned);
    // Drawing and reading back know nothing of each other.
    let (report, urdf) = rayon::join(|| identification.report(&estimate), || identification.urdf());
    let report = report?;
    let urdf = match urdf {
        Ok(exported) => Ok(exported),
        // What a URDF cannot state is no reason to lose the identification.
        Err(reason) if matches!(reason, Error::RobotFile(_)) || reason.job::<ExportError>().is_some() => {
            Err(reason)
        }
        Err(error) => return Err(error.into()),
    };
    drop(progress);

    let loops = if urdf.is_ok() { identification.loops(&urdf_name)? } else { None };
    let urdf_text = urdf.as_ref().ok().map(|u| marked_xml(&u.text));
    let loops = loops.map(|text| marked_toml(&text));
    let json = estimate.to_json();
    let texts = [Some(&json), Some(&report), urdf_text.as_ref(), loops.as_ref()];
    for (number, text) in texts.into_iter().enumerate() {
        text.map(|text| set.write(number, text.as_bytes())).transpose()?;
    }
    let written = set.publish()?;
    notes.warnings(&estimate.verdict.warnings);
    data(&if args.print.json { json } else { summary(&estimate) })?;
    notes.written(&written);
    export::tell(&files[2], &urdf, &estimate, notes);
    if estimate.verdict.status != Status::Ok {
        notes.tell("`dynid explain NAME` says what a check means and what to do");
    }
    Ok(u8::from(estimate.verdict.status == Status::Fail))
}

/// The configuration file with flags over it, or one made of flags alone.
fn configuration(args: &IdentifyArgs, notes: Notes) -> Result<Config, Failure> {
    let logs = GivenLogs { paths: &args.log, rows: args.rows };
    let mut config = run_configuration(&args.input, &logs, notes)?;
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
