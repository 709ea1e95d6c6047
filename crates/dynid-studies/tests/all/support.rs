//! What the tests of the program share.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::path::Path;
use std::process::Output;

use assert_cmd::Command;

/// The program.
pub(crate) fn program() -> Command {
    Command::cargo_bin("dynid-studies").unwrap()
}

/// Runs the program in a folder and expects an exit code.
#[track_caller]
pub(crate) fn run(folder: &Path, args: &[&str], code: i32) -> Output {
    let output = program().current_dir(folder).args(args).output().unwrap();
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "dynid-studies {}: {stderr}", args.join(" "));
    output
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}
