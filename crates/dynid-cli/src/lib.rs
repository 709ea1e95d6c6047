//! The command line program `dynid`, for whatever starts it: the program itself, or the Python package.
//!
//! Results go to stdout, everything else to stderr. Exit codes: 0 done, 1 ran but the verdict is negative, 2 bad input or
//! usage.

mod args;
mod commands;

use std::ffi::OsString;

use dynid_terminal::message::{Failure, end};

use args::{Cli, Command};

/// Does what the arguments say, the first of which is the program's name; gives the exit code.
pub fn run_with(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let run = |mut cli: Cli| {
        cli.command.find_logs()?;
        run(&cli.command)
    };
    end(Cli::of(&arguments).map(|cli| cli.and_then(run)))
}

fn run(command: &Command) -> Result<u8, Failure> {
    match command {
        Command::Backlash(args) => commands::backlash::run(args),
        Command::Check(args) => commands::check::run(args),
        Command::Clearance(args) => commands::clearance::run(args),
        Command::Compare(args) => commands::compare::run(args),
        Command::Completions(args) => commands::completions::run(args),
        Command::Convert(args) => commands::convert::run(args),
        Command::Design(args) => commands::design::run(args),
        Command::Diff(args) => commands::diff::run(args),
        Command::Explain(args) => commands::explain::run(args),
        Command::Export(args) => commands::export::run(args),
        Command::Servo(args) => commands::servo::run(args),
        Command::Fleet(args) => commands::fleet::run(args),
        Command::Friction(args) => commands::friction::run(args),
        Command::Gains(args) => commands::gains::run(args),
        Command::Identify(args) => commands::identify::run(args),
        Command::Init(args) => commands::init::run(args),
        Command::Inspect(args) => commands::inspect::run(args),
        Command::Man(args) => commands::man::run(args),
        Command::Merge(args) => commands::reduce::merge(args),
        Command::Motion(args) => commands::motion::run(args),
        Command::Next(args) => commands::next::run(args),
        Command::Online(args) => commands::online::run(args),
        Command::Payload(args) => commands::payload::run(args),
        Command::Predict(args) => commands::predict::run(args),
        Command::Reduce(args) => commands::reduce::run(args),
        Command::Regressor(args) => commands::regressor::run(args),
        Command::Schema(args) => commands::schema::run(args),
        Command::Simulate(args) => commands::simulate::run(args),
        Command::Solve(args) => commands::reduce::solve(args),
        Command::Study(args) => commands::study::run(args),
        Command::Validate(args) => commands::validate::run(args),
    }
}
