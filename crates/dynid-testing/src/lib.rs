//! Reference data beside the checkout, for tests: the folder `../shared`, which is no part of the repository.
//!
//! A test that asks for what is not there ends at once and counts as skipped: `./test` names a file by `DYNID_SKIPPED`, to which a line is
//! added, since what a passing test prints is not shown.

#![expect(clippy::print_stdout, clippy::panic, reason = "tests say what they do without, and may stop")]

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};

use serde_json::Value;

/// A file or folder of the reference data; without it the test is skipped.
pub fn shared(path: &str) -> Option<PathBuf> {
    let found = shared_if_there(path);
    if found.is_none() {
        skip(if root().is_dir() { "not in ../shared" } else { "no ../shared" });
    }
    found
}

/// A file or folder of the reference data, for a test that does the rest without it.
pub fn shared_if_there(path: &str) -> Option<PathBuf> {
    let found = Some(root().join(path)).filter(|found| found.exists());
    if found.is_none() {
        println!("../shared/{path} is not there");
    }
    found
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared")
}

/// The numbers of `../shared/spec/PATH`, a JSON file; without it the test is skipped.
///
/// # Panics
/// If the file cannot be read or is no JSON.
pub fn reference(path: &str) -> Option<Value> {
    let file = shared(&format!("spec/{path}"))?;
    let text = std::fs::read(&file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    Some(serde_json::from_slice(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display())))
}

/// The golden numbers of `../shared/spec/golden/NAME`; without them the test is skipped.
///
/// # Panics
/// As [`reference()`].
pub fn golden(name: &str) -> Option<Value> {
    reference(&format!("golden/{name}"))
}

/// Counts the running test as skipped, for a reason in a few words. It should end now.
///
/// # Panics
/// If the file that `DYNID_SKIPPED` names cannot be written.
pub fn skip(reason: &str) {
    println!("skipped: {reason}");
    let Some(file) = std::env::var_os("DYNID_SKIPPED") else { return };
    // A test has a thread of its own that bears its name.
    let thread = std::thread::current();
    let program = std::env::current_exe().unwrap_or_default();
    let program = program.file_name().unwrap_or_default().to_string_lossy();
    let line = format!("{reason}\t{program}\t{}\n", thread.name().unwrap_or("main"));
    let append = |file: File| (&file).write_all(line.as_bytes());
    // One write of a short line is whole, whoever else writes.
    let written = OpenOptions::new().create(true).append(true).open(file).and_then(append);
    written.unwrap_or_else(|e| panic!("DYNID_SKIPPED: {e}"));
}
