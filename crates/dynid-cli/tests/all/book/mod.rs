//! README and book: every command is run, every file parsed, every link followed, every generated page compared with its source.
//!
//! A fenced block says what it is by the words behind the fence:
//!
//! - `console`: lines that begin with `$ ` are run by `sh` with `dynid` on the path, in a folder that belongs to the page and holds
//!   `examples` and `robots`. What follows a command is compared with what it prints (both streams), see [`shown`]. `exit=1` is the exit
//!   code of the block's last command (0 without it), `digits=2` the digits to which numbers agree (3), `slow` leaves the block to the
//!   tests that take long.
//! - `toml run`, `toml design`, `toml motion`, `toml friction`, `toml simulate`, `toml robot`: a file of that kind, which must parse; `part`: an
//!   excerpt of one. `file=NAME` (any block) writes the text into the folder of the page.
//! - `json` must parse, `sh` holds commands that other tests run, `rust` is a doc test, `text` is anything.
//!
//! `<!-- goes on from PAGE -->` gives a page the folder as the other page leaves it.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

mod blocks;
mod console;
mod elements;
mod files;
mod keys;
mod links;
mod shown;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use blocks::Page;

/// Root of the repository.
fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").canonicalize().unwrap()
}

/// The README and the pages of the book, by their path in `docs/book/src` (`README.md` for the README).
fn pages() -> BTreeMap<String, Page> {
    let source = root().join("docs/book/src");
    let mut pages = BTreeMap::from([("README.md".to_owned(), Page::read(&root().join("README.md")))]);
    for file in markdown_below(&source) {
        let name = file.strip_prefix(&source).unwrap().display().to_string();
        pages.insert(name, Page::read(&file));
    }
    pages
}

/// Every Markdown file in a folder and in the folders below it, sorted.
fn markdown_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(markdown_below(&path));
        } else if path.extension().is_some_and(|e| e == "md") {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[track_caller]
fn demand_none(faults: &[String]) {
    assert!(faults.is_empty(), "{} faults\n\n{}", faults.len(), faults.join("\n\n"));
}

#[test]
fn commands_print_what_the_pages_show() {
    demand_none(&console::run_all(&pages(), false));
}

#[test]
#[ignore = "most of a minute: studies and other long commands of the book"]
fn long_commands_print_what_the_pages_show() {
    demand_none(&console::run_all(&pages(), true));
}

#[test]
fn files_on_the_pages_are_what_they_claim() {
    let faults: Vec<String> = pages()
        .iter()
        .flat_map(|(name, page)| page.blocks.iter().filter_map(|b| files::fault(name, b)))
        .collect();
    demand_none(&faults);
}

#[test]
fn links_lead_somewhere() {
    demand_none(&links::broken(&root()));
}

#[test]
fn the_summary_lists_every_page_once() {
    demand_none(&links::summary_faults(&root().join("docs/book/src")));
}

/// Numbers of a text, as they are written.
fn numbers(text: &str) -> Vec<&str> {
    let parts = text.split(|c: char| !(c.is_ascii_digit() || c == '.')).map(|word| word.trim_matches('.'));
    parts.filter(|word| word.contains(|c: char| c.is_ascii_digit())).collect()
}

#[test]
fn numbers_of_the_readme_are_those_of_the_results() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let results = std::fs::read_to_string(root().join("docs/results.md")).unwrap();
    let (_, rest) = readme.split_once("## What it does better").expect("the section with claims");
    let (claims, _) = rest.split_once("\n## ").unwrap();
    let measured = numbers(&results);
    let claimed = numbers(claims);
    assert!(claimed.len() > 4, "{claimed:?}");
    let faults: Vec<String> = claimed
        .into_iter()
        .filter(|number| !measured.contains(number))
        .map(|number| format!("README.md claims {number}, which docs/results.md does not have"))
        .collect();
    demand_none(&faults);
}
