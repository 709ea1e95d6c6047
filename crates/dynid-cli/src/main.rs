//! The command line program `dynid`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(dynid_cli::run_with(std::env::args_os()))
}
