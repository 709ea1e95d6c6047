//! `dynid identify`.

mod summary;

use std::path::{Path, PathBuf};

use dynid::config::{Config, Consistency, Friction, Method, Route};
use dynid::export::{ExportError, Source};
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
    let robot = RobotNames::of(&config.robot);
    let names = ["estimate.json", "report.html", robot.main.as_str(), robot.loops.as_str()];
    let names = names.into_iter().chain(robot.included.iter().map(String::as_str));
    let files: Vec<PathBuf> = names.map(|name| out.join(name)).collect();
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
    let (report, exported) = rayon::join(|| identification.report(&estimate), || identification.robot_file());
    let report = report?;
    let exported = match exported {
        Ok(exported) => Ok(exported),
        // What a robot file cannot state is no reason to lose the identification.
        Err(reason) if matches!(reason, Error::RobotFile(_)) || reason.job::<ExportError>().is_some() => {
            Err(reason)
        }
        Err(error) => return Err(error.into()),
    };
    drop(progress);

    let keeps_loops = robot.is_mjcf || exported.is_err();
    let loops = if keeps_loops { None } else { identification.loops(&robot.main)? };
    let text = exported.as_ref().ok().map(|e| marked_xml(&e.text));
    let loops = loops.map(|text| marked_toml(&text));
    let json = estimate.to_json();
    let texts = [Some(&json), Some(&report), text.as_ref(), loops.as_ref()];
    for (number, text) in texts.into_iter().enumerate() {
        text.map(|text| set.write(number, text.as_bytes())).transpose()?;
    }
    for (name, text) in exported.iter().flat_map(|e| &e.included) {
        if let Some(k) = robot.included.iter().position(|included| included == name) {
            set.write(texts.len() + k, marked_xml(text).as_bytes())?;
        }
    }
    let written = set.publish()?;
    notes.warnings(&estimate.verdict.warnings);
    data(&if args.print.json { json } else { summary(&estimate) })?;
    notes.written(&written);
    let format = if robot.is_mjcf { "--mjcf" } else { "--urdf" };
    export::tell(&files[2], &exported, format, &estimate, notes);
    if estimate.verdict.status != Status::Ok {
        notes.tell("`dynid explain NAME` says what a check means and what to do");
    }
    Ok(u8::from(estimate.verdict.status == Status::Fail))
}

/// Names of the files that a robot becomes.
struct RobotNames {
    main: String,
    loops: String,
    /// Files that it includes, and that may change with it.
    included: Vec<String>,
    is_mjcf: bool,
}

impl RobotNames {
    /// A robot that cannot be read is told of by whoever needs it.
    fn of(path: &Path) -> Self {
        let stem = match path == Path::new("-") {
            true => "robot".to_owned(),
            false => dynid::io::robot::stem(path),
        };
        let source = Source::read(path).ok();
        let is_mjcf = source.as_ref().is_some_and(Source::is_mjcf);
        RobotNames {
            main: format!("{stem}.{}", if is_mjcf { "xml" } else { "urdf" }),
            loops: format!("{stem}.loops.toml"),
            included: source.iter().flat_map(Source::included).map(str::to_owned).collect(),
            is_mjcf,
        }
    }
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
