//! Tells the program its version with the revision that it is built from, and the revision itself.
//!
//! The revision comes from `DYNID_REVISION` in the environment of the build, else from the repository of this source; without either
//! there is none.

use std::path::Path;
use std::process::Command;

/// Digits of the revision that `--version` shows.
const SHOWN: usize = 12;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-env-changed=DYNID_REVISION");
    let given = std::env::var("DYNID_REVISION").ok().filter(|revision| !revision.is_empty());
    let Some(revision) = given.or_else(of_repository) else { return };
    let shown: String = revision.chars().take(SHOWN).collect();
    println!("cargo:rustc-env=DYNID_REVISION={revision}");
    println!("cargo:rustc-env=DYNID_VERSION={} ({shown})", env!("CARGO_PKG_VERSION"));
}

/// The commit that is checked out.
fn of_repository() -> Option<String> {
    // The record of what HEAD was changes with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        && Path::new(&log).exists()
    {
        println!("cargo:rerun-if-changed={log}");
    }
    // The repository of a program that unpacked this source inside of its own is not meant.
    git(&["ls-files", "--error-unmatch", "build.rs"])?;
    git(&["rev-parse", "HEAD"])
}

/// What git says in the folder of this crate; `None` without git or a repository.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned()).filter(|text| !text.is_empty())
}
