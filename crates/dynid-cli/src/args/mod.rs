//! Arguments: the program and its commands; a file per group of commands.

mod about;
mod design;
mod elements;
mod examples;
mod experiments;
mod identify;
mod logs;
mod model;
mod motion;
mod online;
mod reduce;
mod robot;
mod simulate;

pub(crate) use dynid_terminal::args::{ForceArgs, PrintArgs};
pub(crate) use dynid_terminal::study::StudyArgs;

pub(crate) use about::{CompletionsArgs, ExplainArgs, ManArgs};
pub(crate) use design::{ColumnsArg, CriterionArg, DesignArgs, DesignedArgs, NextArgs};
pub(crate) use experiments::{
    BacklashArgs, ClearanceArgs, FrictionTestArgs, GainsArgs, PayloadArgs, ServoArgs,
};
pub(crate) use identify::{
    CheckArgs, CompareArgs, ConsistencyArg, FrictionArg, IdentifyArgs, MethodArg, RouteArg,
};
pub(crate) use logs::{ConvertArgs, InitArgs, LogArgs, MissingArg, ReadingArgs};
pub(crate) use model::{
    DiffArgs, ExportArgs, InspectArgs, PredictArgs, RegressorArgs, SchemaArgs, ValidateArgs,
};
pub(crate) use motion::{MotionArgs, PlaybackArg};
pub(crate) use online::{OnlineArgs, StreamArg};
pub(crate) use reduce::{FactorsArgs, FleetArgs, MergeArgs, ReduceArgs, SolveArgs};
pub(crate) use robot::RobotArgs;
pub(crate) use simulate::SimulateArgs;

use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::OnceLock;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand, ValueHint};
use dynid::io::log::{files, is_log};
use dynid_terminal::message::Failure;

/// Version with the revision that the program was built from, where that is known.
pub(crate) const VERSION: &str = match option_env!("DYNID_VERSION") {
    Some(version) => version,
    None => env!("CARGO_PKG_VERSION"),
};

/// Identifies the dynamic parameters of robots and mechanisms from logs of motion and effort.
#[derive(Debug, Parser)]
#[command(name = "dynid", version = VERSION, propagate_version = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Commands, in the order of their names.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Backlash of an identified robot's drives from ordinary logs: what gaps would have done to the effort.
    Backlash(BacklashArgs),
    /// Pre-flight of logs: clock, joint order, signs, units, delay, saturation, excitation.
    Check(CheckArgs),
    /// Clearances of an identified robot's joints from a log: by probes at the journals, by their swing in the effort.
    Clearance(ClearanceArgs),
    /// Every applicable estimator on the same logs, ranked on held-out time.
    Compare(CompareArgs),
    /// Print what a shell needs to complete commands, flags and files.
    Completions(CompletionsArgs),
    /// Write a log in another format: CSV, Parquet, NumPy or MCAP; as it is, or as the signals of a robot.
    Convert(ConvertArgs),
    /// Design an excitation trajectory within all limits: writes trajectory files, design.json and report.html.
    Design(Box<DesignArgs>),
    /// Compare two models of a robot: parameters that differ beyond their intervals, difference of the effort.
    Diff(DiffArgs),
    /// Say what a finding, a check or a verdict means and what to do.
    Explain(ExplainArgs),
    /// Put identified parameters into a robot file: URDF, MJCF or JSON, read back and checked before it is written.
    Export(ExportArgs),
    /// Many robots of a type from the factors of their logs: what they share, how each differs, what changes when; writes fleet.json,
    /// report.html and pages of robots.
    Fleet(FleetArgs),
    /// Friction from constant-speed tests and pre-sliding motion: writes friction.json and report.html.
    Friction(FrictionTestArgs),
    /// Drive gains from logs with and without a payload of known mass.
    Gains(GainsArgs),
    /// Identify a robot from logs: writes estimate.json, report.html and an updated robot file.
    Identify(Box<IdentifyArgs>),
    /// Write a commented configuration for a robot and its logs: what their columns are, units, time, validation.
    Init(InitArgs),
    /// Show a robot's tree, its parameters and which combinations of them can be identified; of a log, its columns, rates and gaps.
    Inspect(InspectArgs),
    /// Write manual pages, one per command.
    Man(ManArgs),
    /// Merge factors of logs, in any order with the same bytes.
    Merge(MergeArgs),
    /// Make test motions within the limits: sweeps, tracks, circles, small sinusoids, pauses, loads; writes trajectory files,
    /// motion.json and report.html.
    Motion(Box<MotionArgs>),
    /// Design what to record next: the shortest motion that brings parameters to wanted intervals, given the factors of all earlier logs;
    /// writes trajectory files, next.json and report.html.
    Next(Box<NextArgs>),
    /// Follow a stream or logs: estimates as JSON lines, alarms when something changes.
    Online(OnlineArgs),
    /// Payloads from logs with and without them: mass, centre of mass, inertia; writes payload.json, payload.html and a URDF
    /// link.
    Payload(PayloadArgs),
    /// Effort of an identified model at given states.
    Predict(PredictArgs),
    /// Reduce logs to factors, by what an identification chose: whatever lies apart can be merged and solved.
    Reduce(Box<ReduceArgs>),
    /// Effort and regressor rows of a robot file at given states.
    Regressor(RegressorArgs),
    /// Print the JSON Schema of a result.
    Schema(SchemaArgs),
    /// Drives that log commands and positions only: gains, friction, rotor inertia, delay by simulation; writes servo.json, report.html, the
    /// robot file and tables of actuators.
    Servo(ServoArgs),
    /// Make a virtual log: by inverse dynamics, or of a controlled robot.
    Simulate(SimulateArgs),
    /// Estimate from factors of logs: writes estimate.json and report.html.
    Solve(SolveArgs),
    /// Published systems, every claim of their papers beside what is measured here.
    Study(StudyArgs),
    /// Compare an identified model with other logs.
    Validate(ValidateArgs),
}

impl Command {
    /// Puts the logs that patterns, folders and lists stand for in their place.
    ///
    /// # Errors
    /// There is no such log, or several where a command takes one.
    pub(crate) fn find_logs(&mut self) -> Result<(), Failure> {
        let (lists, one) = self.logs();
        for list in lists {
            let found = list.iter().map(|path| files(path)).collect::<Result<Vec<_>, _>>();
            *list = found.map_err(dynid::Error::from)?.concat();
        }
        let Some(path) = one else { return Ok(()) };
        let found = files(path).map_err(dynid::Error::from)?;
        let [log] = found.as_slice() else {
            let names: Vec<String> = found.iter().map(|log| log.display().to_string()).collect();
            let more = if names.len() > 3 { ", .." } else { "" };
            let names = names[..names.len().min(3)].join(", ");
            let text = format!("{}: expected one log, found {}: {names}{more}", path.display(), found.len());
            return Err(Failure::Usage(text, "this command takes one log: name it"));
        };
        log.clone_into(path);
        Ok(())
    }

    /// Arguments that are logs: lists of them, or a single one.
    fn logs(&mut self) -> (Vec<&mut Vec<PathBuf>>, Option<&mut PathBuf>) {
        match self {
            Command::Backlash(args) => (vec![&mut args.log], None),
            Command::Check(args) => match args.robot {
                Some(_) => (vec![&mut args.log, &mut args.input], None),
                None => (vec![&mut args.log], None),
            },
            Command::Clearance(args) => (Vec::new(), Some(&mut args.log)),
            Command::Compare(args) => (vec![&mut args.log], None),
            Command::Convert(args) => (Vec::new(), Some(&mut args.log)),
            Command::Export(args) => (vec![&mut args.log], None),
            Command::Identify(args) => (vec![&mut args.log, &mut args.validate], None),
            Command::Init(args) => (vec![&mut args.log], None),
            Command::Inspect(args) if is_log(&args.robot.robot) => (Vec::new(), Some(&mut args.robot.robot)),
            Command::Online(args) => (vec![&mut args.log], None),
            Command::Reduce(args) => (vec![&mut args.log], None),
            Command::Servo(args) => (vec![&mut args.log, &mut args.validate], None),
            Command::Solve(args) => (vec![&mut args.validate], None),
            Command::Validate(args) => (vec![&mut args.log], None),
            _ => (Vec::new(), None),
        }
    }
}

static COMMAND_LINE: OnceLock<Vec<String>> = OnceLock::new();

/// The command line of this process, as results record it.
pub(crate) fn command_line() -> Vec<String> {
    COMMAND_LINE.get().cloned().unwrap_or_default()
}

/// The command line as the parser, help, completions and manual pages know it.
pub(crate) fn definition() -> clap::Command {
    examples::with_examples(Cli::command())
}

impl Cli {
    /// Parses arguments, the first of which is the program's name.
    ///
    /// # Errors
    /// What clap says of them; help and version too.
    pub(crate) fn of(arguments: &[OsString]) -> Result<Result<Self, Failure>, clap::Error> {
        let definition = definition();
        let matches = definition.clone().try_get_matches_from(arguments)?;
        let words = arguments.iter().map(|a| a.to_string_lossy().into_owned()).collect();
        // One command line per process: a second one would stand beside the first in results.
        let _ = COMMAND_LINE.set(words);
        let cli = Self::from_arg_matches(&matches)?;
        Ok(one_standard_input(&definition, &matches).map(|()| cli))
    }
}

/// Refuses `-` for more than one input, or for more than one output.
fn one_standard_input(definition: &clap::Command, matches: &clap::ArgMatches) -> Result<(), Failure> {
    let Some((name, given)) = matches.subcommand() else { return Ok(()) };
    let Some(command) = definition.find_subcommand(name) else { return Ok(()) };
    for (hint, what, cure) in [
        (ValueHint::FilePath, "standard input", "give all inputs but one as files"),
        (ValueHint::AnyPath, "standard output", "give all outputs but one as files"),
    ] {
        let dashes = |arg: &clap::Arg| {
            let values = given.try_get_raw(arg.get_id().as_str()).ok().flatten();
            values.map_or(0, |values| values.filter(|value| *value == "-").count())
        };
        let of_kind = command.get_arguments().filter(|arg| arg.get_value_hint() == hint);
        if of_kind.map(dashes).sum::<usize>() > 1 {
            return Err(Failure::Usage(format!("{what}: `-` is given more than once"), cure));
        }
    }
    Ok(())
}
