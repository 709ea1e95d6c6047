//! The command line program `dynid`.
//!
//! Data goes to stdout, everything else to stderr. Exit codes: 0 done, 1 ran but the verdict is negative, 2 bad input or
//! usage.

mod args;
mod commands;
mod message;
mod outputs;
mod progress;

use std::process::ExitCode;

use clap::Parser;

use args::{Cli, Command};

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => {
            // Help and version are asked for and go to stdout; clap exits with 2 on misuse.
            let code = u8::try_from(error.exit_code()).unwrap_or(2);
            let _ = error.print();
            return ExitCode::from(code);
        }
    };
    let outcome = match cli.command {
        Command::Inspect(args) => commands::inspect::run(&args),
        Command::Regressor(args) => commands::regressor::run(&args),
        Command::Init(args) => commands::init::run(&args),
        Command::Check(args) => commands::check::run(&args),
        Command::Compare(args) => commands::compare::run(&args),
        Command::Identify(args) => commands::identify::run(&args),
        Command::Predict(args) => commands::predict::run(&args),
        Command::Design(args) => commands::design::run(&args),
        Command::Friction(args) => commands::friction::run(&args),
        Command::Simulate(args) => commands::simulate::run(&args),
        Command::Backlash(args) => commands::backlash::run(&args),
        Command::Clearance(args) => commands::clearance::run(&args),
        Command::Gains(args) => commands::gains::run(&args),
        Command::Payload(args) => commands::payload::run(&args),
        Command::Validate(args) => commands::validate::run(&args),
        Command::Online(args) => commands::online::run(&args),
        Command::Study(args) => commands::study::run(&args),
        Command::Export(args) => commands::export::run(&args),
    };
    match outcome {
        Ok(code) => ExitCode::from(code),
        Err(failure) => failure.report(),
    }
}
