//! Runs the commands of pages.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use tempfile::TempDir;

use super::blocks::{Block, Page};
use super::{root, shown};

/// Lines of output that a fault quotes.
const QUOTED_LINES: usize = 60;

/// Runs the commands of all pages, or of the pages with slow ones alone; returns what is not as shown.
pub(super) fn run_all(pages: &BTreeMap<String, Page>, slow: bool) -> Vec<String> {
    let mut run =
        Run { pages, slow, folders: tempfile::tempdir().unwrap(), done: BTreeMap::new(), faults: Vec::new() };
    for (name, page) in pages {
        let has_commands = page.blocks.iter().any(|b| b.has("console") && (!slow || b.has("slow")));
        if has_commands {
            run.page(name);
        }
    }
    run.faults
}

struct Run<'a> {
    pages: &'a BTreeMap<String, Page>,
    slow: bool,
    folders: TempDir,
    done: BTreeMap<String, PathBuf>,
    faults: Vec<String>,
}

impl Run<'_> {
    /// Runs a page, and the page that it goes on from; returns the folder as it leaves it.
    fn page(&mut self, name: &str) -> PathBuf {
        if let Some(folder) = self.done.get(name) {
            return folder.clone();
        }
        let Some(page) = self.pages.get(name) else { panic!("no page {name} to go on from") };
        let folder = self.folders.path().join(name.replace(['/', '.'], "-"));
        let begins_with = match &page.goes_on_from {
            Some(before) => vec![self.page(before).join(".")],
            None => vec![root().join("examples"), root().join("robots")],
        };
        std::fs::create_dir_all(&folder).unwrap();
        let copied = Command::new("cp").arg("-r").args(begins_with).arg(&folder).status().unwrap();
        assert!(copied.success(), "{name}: folder");
        for block in &page.blocks {
            if let Some(file) = block.value("file") {
                std::fs::write(folder.join(file), &block.text).unwrap();
            }
            if block.has("console") && (self.slow || !block.has("slow")) {
                self.block(name, block, &folder);
            }
        }
        self.done.insert(name.to_owned(), folder.clone());
        folder
    }

    fn block(&mut self, page: &str, block: &Block, folder: &Path) {
        let exit: i32 = block.value("exit").map_or(0, |code| code.parse().unwrap());
        let digits: i32 = block.value("digits").map_or(3, |digits| digits.parse().unwrap());
        let commands = commands(&block.text);
        let count = commands.len();
        for (index, (command, expected)) in commands.into_iter().enumerate() {
            let (code, printed) = run(&command, folder);
            let demanded = if index + 1 == count { exit } else { 0 };
            let differs = (!expected.trim().is_empty())
                .then(|| shown::difference(&expected, &printed, digits))
                .flatten();
            let why = match differs {
                _ if code != Some(demanded) => format!("exit code {code:?}, demanded {demanded}"),
                Some(difference) => difference,
                None => continue,
            };
            let quoted: Vec<&str> = printed.lines().take(QUOTED_LINES).collect();
            let quoted = quoted.join("\n");
            self.faults.push(format!("{page}:{}: $ {command}\n{why}\n--- printed:\n{quoted}", block.line));
        }
    }
}

/// Commands of a block and what it shows of their output. A command goes on behind a backslash at its end.
fn commands(text: &str) -> Vec<(String, String)> {
    let mut found: Vec<(String, String)> = Vec::new();
    let mut goes_on = false;
    for line in text.lines() {
        if let Some(command) = line.strip_prefix("$ ") {
            found.push((command.to_owned(), String::new()));
            goes_on = command.ends_with('\\');
        } else if let Some((command, expected)) = found.last_mut() {
            let part = if goes_on { command } else { expected };
            part.push('\n');
            part.push_str(line);
            goes_on = goes_on && line.ends_with('\\');
        } else {
            panic!("a console block begins with a command, not with {line:?}");
        }
    }
    found
}

/// Exit code and both streams, as they come.
fn run(command: &str, folder: &Path) -> (Option<i32>, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_dynid"));
    let path =
        format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", &format!("{{ {command}\n}} 2>&1")])
        .current_dir(folder)
        .env("PATH", path)
        .stdin(Stdio::null())
        .output()
        .unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned())
}
