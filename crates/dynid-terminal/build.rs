//! Digests the sources of all crates but the program `dynid`, so that the program of studies can tell that it was built from the same.
//!
//! A package without the crates beside it has no digest; its version has to do.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// Folders of crates that are part of no program.
const LEFT_OUT: [&str; 3] = ["tests", "benches", "examples"];

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    let root = Path::new("../..");
    if !root.join("robots").is_dir() {
        return;
    }
    let own = |path: &PathBuf| path.ends_with("dynid-cli");
    let crates = entries(&root.join("crates")).into_iter().filter(|path| !own(path));
    let parts = crates.flat_map(|folder| entries(&folder)).chain([root.join("robots")]);
    let is_left_out = |part: &PathBuf| LEFT_OUT.iter().any(|name| part.ends_with(name));
    let mut digest = DefaultHasher::new();
    for part in parts.filter(|part| !is_left_out(part)) {
        // Whole folders: a new file counts.
        println!("cargo:rerun-if-changed={}", part.display());
        add(&part, &mut digest);
    }
    println!(
        "cargo:rustc-env=DYNID_STUDIES_VERSION={} (sources {:016x})",
        env!("CARGO_PKG_VERSION"),
        digest.finish()
    );
}

/// Adds names and contents of files, but for documents.
fn add(path: &Path, digest: &mut DefaultHasher) {
    if path.is_dir() {
        entries(path).iter().for_each(|entry| add(entry, digest));
    } else if path.extension().is_none_or(|e| e != "md") {
        path.hash(digest);
        std::fs::read(path).ok().hash(digest);
    }
}

/// What is in a folder, sorted.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let Ok(found) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = found.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort();
    paths
}
