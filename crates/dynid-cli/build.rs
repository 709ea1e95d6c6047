//! Tells the program the revision that it is built from; without a repository there is none.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // The record of what HEAD was changes with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"])
        && Path::new(&log).exists()
    {
        println!("cargo:rerun-if-changed={log}");
    }
    // The repository of a program that unpacked this source inside of its own is not meant.
    let own = git(&["ls-files", "--error-unmatch", "build.rs"]).is_some();
    if let Some(revision) = git(&["rev-parse", "HEAD"]).filter(|_| own) {
        println!("cargo:rustc-env=DYNID_REVISION={revision}");
    }
}

/// What git says in the folder of this crate; `None` without git or a repository.
fn git(args: &[&str]) -> Option<String> {
    let output = Command::new("git").args(args).output().ok().filter(|o| o.status.success())?;
    Some(String::from_utf8(output.stdout).ok()?.trim().to_owned()).filter(|text| !text.is_empty())
}
