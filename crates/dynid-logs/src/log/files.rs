//! The logs that a path stands for: a file, a pattern, a folder, a list.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Component, Path, PathBuf};

use dynid_files::FileMember;
use dynid_files::excerpt::listed;
use dynid_files::input;

use super::member::{has_pattern, is_manifest, is_pattern};
use super::open::{is_log, is_log_folder, members};
use crate::csv::LogFileError;

/// Deepest folders that `**` looks into.
const MAX_DEPTH: usize = 32;
/// Most logs that a path may stand for.
const MAX_LOGS: usize = 100_000;
/// Names that a message lists.
const NAMES: usize = 6;

/// The logs that a path stands for, always in the same order.
///
/// - A file is itself, `FILE#MEMBER` too, and a folder that is a log (a bag, a dataset).
/// - A name with `*`, `?` or `[..]` that no file has is a pattern, in any folder of the path: what is called so, sorted by name. `*` is
///   any text within a name, `?` one character, `[a-z]` one of those, `[!a-z]` another one, and `**` any number of folders. Names that begin with a
///   point take a pattern that does.
/// - `FILE#PATTERN` is the episodes of a dataset and the groups of an HDF5 file that are called so.
/// - Any other folder is the logs in it ([`is_log`](super::is_log)), sorted by name; folders in it count if they are logs.
/// - A text file called `NAME.manifest` lists logs: one path, pattern or folder per line, relative to the file, in this order. Empty lines and
///   those that begin with `#` count for nothing.
///
/// # Errors
/// [`LogFileError::NoLogs`]: nothing is called so; [`LogFileError::Listed`]: a line of a list names no log, or one that was named before;
/// those of files whose members are asked for.
pub fn files(path: &Path) -> Result<Vec<PathBuf>, LogFileError> {
    match is_manifest(path) && path.is_file() {
        true => of_manifest(path),
        false => named(path),
    }
}

/// Logs of a path that is no list.
fn named(path: &Path) -> Result<Vec<PathBuf>, LogFileError> {
    let FileMember { path: file, member } = FileMember::of(path);
    let found = match is_pattern(&file) {
        true => matching(&file)?,
        false => vec![file],
    };
    let mut logs = Vec::new();
    for file in found {
        match &member {
            Some(pattern) if has_pattern(pattern) => logs.extend(of_members(&file, pattern)?),
            Some(member) => logs.push(with_member(&file, member)),
            None if file.is_dir() && !is_log_folder(&file) => logs.extend(in_folder(&file)?),
            None => logs.push(file),
        }
        if logs.len() > MAX_LOGS {
            return Err(nothing(
                path,
                path,
                format!("more than {MAX_LOGS}, the most that a path may stand for"),
            ));
        }
    }
    Ok(logs)
}

fn with_member(file: &Path, member: &str) -> PathBuf {
    let mut text = file.as_os_str().to_owned();
    text.push("#");
    text.push(member);
    text.into()
}

/// Members of a file by a pattern; of a file whose members are no logs of their own, such as topics of a bag, what was stated.
fn of_members(file: &Path, pattern: &str) -> Result<Vec<PathBuf>, LogFileError> {
    let Some(all) = members(file)? else { return Ok(vec![with_member(file, pattern)]) };
    let chosen: Vec<PathBuf> =
        all.iter().filter(|name| fits(pattern, name)).map(|name| with_member(file, name)).collect();
    match chosen.is_empty() {
        true => Err(nothing(&with_member(file, pattern), file, listed(&all, NAMES))),
        false => Ok(chosen),
    }
}

/// The logs in a folder.
fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, LogFileError> {
    let all = entries(folder);
    let is_one = |path: &&PathBuf| {
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        !hidden && if path.is_dir() { is_log_folder(path) } else { is_log(path) }
    };
    let logs: Vec<PathBuf> = all.iter().filter(is_one).cloned().collect();
    match logs.is_empty() {
        true => Err(nothing(folder, folder, listed(&names(&all), NAMES))),
        false => Ok(logs),
    }
}

/// What is in a folder, sorted; nothing, if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let place = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let read = fs::read_dir(place).into_iter().flatten().flatten();
    let mut all: Vec<PathBuf> = read.map(|entry| folder.join(entry.file_name())).collect();
    all.sort();
    all
}

fn names(paths: &[PathBuf]) -> Vec<String> {
    let name = |path: &PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
    paths.iter().filter_map(name).collect()
}

fn nothing(pattern: &Path, place: &Path, there: String) -> LogFileError {
    let place = if place.as_os_str().is_empty() { Path::new(".") } else { place };
    LogFileError::NoLogs {
        pattern: pattern.display().to_string(),
        place: place.display().to_string(),
        there: there.into(),
    }
}

/// What is called as the parts of a pattern say.
fn matching(pattern: &Path) -> Result<Vec<PathBuf>, LogFileError> {
    let mut found = vec![PathBuf::new()];
    let mut parts = pattern.components().peekable();
    while let Some(part) = parts.next() {
        let text = part.as_os_str().to_string_lossy();
        let before = found.clone();
        found = match part {
            // A name with a bracket is a name where there is a file of it.
            Component::Normal(name) if has_pattern(&text) => {
                let one = |folder: &PathBuf| match folder.join(name).exists() {
                    true => vec![folder.join(name)],
                    false if text == "**" => below(folder, 0),
                    false => entries(folder).into_iter().filter(|path| is_called(path, &text)).collect(),
                };
                before.iter().flat_map(one).collect()
            }
            _ => before.iter().map(|folder| folder.join(part)).filter(|path| path.exists()).collect(),
        };
        if parts.peek().is_some() {
            found.retain(|path| path.is_dir());
        }
        found.sort();
        found.dedup();
        if found.is_empty() {
            return Err(none_called(pattern, &before));
        }
    }
    Ok(found)
}

/// The message names the folder that was looked into last.
fn none_called(pattern: &Path, looked_into: &[PathBuf]) -> LogFileError {
    let [folder] = looked_into else {
        let text = format!("{} folders", looked_into.len());
        let all: Vec<PathBuf> = looked_into.iter().flat_map(|folder| entries(folder)).collect();
        return nothing(pattern, Path::new(&text), listed(&names(&all), NAMES));
    };
    nothing(pattern, folder, listed(&names(&entries(folder)), NAMES))
}

/// A folder and all folders in it; links are not followed.
fn below(folder: &Path, depth: usize) -> Vec<PathBuf> {
    let mut all = vec![folder.to_owned()];
    if depth < MAX_DEPTH {
        let is_folder = |path: &PathBuf| path.is_dir() && !path.is_symlink() && is_called(path, "*");
        all.extend(entries(folder).into_iter().filter(is_folder).flat_map(|inner| below(&inner, depth + 1)));
    }
    all
}

fn is_called(path: &Path, pattern: &str) -> bool {
    let Some(name) = path.file_name().map(|name| name.to_string_lossy()) else { return false };
    (!name.starts_with('.') || pattern.starts_with('.')) && fits(pattern, &name)
}

/// Whether a name is as a pattern says, from its first character to its last.
fn fits(pattern: &str, name: &str) -> bool {
    let (pattern, name): (Vec<char>, Vec<char>) = (pattern.chars().collect(), name.chars().collect());
    let (mut p, mut n) = (0, 0);
    // Behind the last star, and the character that it has not taken yet.
    let mut again: Option<(usize, usize)> = None;
    while n < name.len() {
        if pattern.get(p) == Some(&'*') {
            again = Some((p + 1, n));
            p += 1;
        } else if let Some(next) = fits_one(&pattern, p, name[n]) {
            (p, n) = (next, n + 1);
        } else if let Some((behind, taken)) = again {
            (p, n) = (behind, taken + 1);
            again = Some((behind, taken + 1));
        } else {
            return false;
        }
    }
    pattern[p..].iter().all(|c| *c == '*')
}

/// The place behind what stands for one character at `p`, if it stands for this one.
fn fits_one(pattern: &[char], p: usize, c: char) -> Option<usize> {
    match pattern.get(p)? {
        '?' => Some(p + 1),
        '[' => {
            let negated = pattern.get(p + 1) == Some(&'!');
            let first = p + 1 + usize::from(negated);
            // A bracket that comes first is one of the characters; one that is not closed stands for itself.
            let close = pattern.iter().skip(first + 1).position(|x| *x == ']').map(|k| first + 1 + k);
            let Some(close) = close else { return (c == '[').then_some(p + 1) };
            let (mut k, mut is_one) = (first, false);
            while k < close {
                if k + 2 < close && pattern[k + 1] == '-' {
                    is_one |= (pattern[k]..=pattern[k + 2]).contains(&c);
                    k += 3;
                } else {
                    is_one |= pattern[k] == c;
                    k += 1;
                }
            }
            (is_one != negated).then_some(close + 1)
        }
        own => (*own == c).then_some(p + 1),
    }
}

/// The logs that a text file lists.
fn of_manifest(path: &Path) -> Result<Vec<PathBuf>, LogFileError> {
    let file = path.display().to_string();
    let text =
        input::read_text(path).map_err(|error| LogFileError::Unreadable { file: file.clone(), error })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut logs = Vec::new();
    let mut lines: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for (k, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let fault = |expected: &'static str, found: String| LogFileError::Listed {
            file: file.clone(),
            line: k + 1,
            expected,
            found: found.into(),
        };
        let stated = folder.join(line);
        let FileMember { path: named_file, .. } = FileMember::of(&stated);
        if is_manifest(&named_file) {
            return Err(fault("a log, a pattern or a folder", format!("another list, `{line}`")));
        }
        if !named_file.exists() && !is_pattern(&named_file) {
            return Err(fault("a file that is there", format!("`{}`, which is not", named_file.display())));
        }
        let found = named(&stated).map_err(|error| match error {
            LogFileError::NoLogs { place, there, .. } => {
                fault("logs", format!("none called `{line}` in `{place}`: {there}"))
            }
            other => other,
        })?;
        for log in found {
            if let Some(before) = lines.insert(log.clone(), k + 1) {
                let found = format!("`{}` of line {before} again", log.display());
                return Err(fault("every log once", found));
            }
            logs.push(log);
        }
    }
    match logs.is_empty() {
        true => Err(LogFileError::Listed {
            file,
            line: text.lines().count().max(1),
            expected: "at least one log above",
            found: "none".into(),
        }),
        false => Ok(logs),
    }
}

#[cfg(test)]
mod tests {
    use super::fits;

    #[test]
    fn patterns_fit_whole_names() {
        for (pattern, name, expected) in [
            ("*.csv", "a.csv", true),
            ("*.csv", "a.csv.gz", false),
            ("run_?.csv", "run_1.csv", true),
            ("run_?.csv", "run_10.csv", false),
            ("run_[0-3].csv", "run_2.csv", true),
            ("run_[!0-3].csv", "run_2.csv", false),
            ("run_[!0-3].csv", "run_7.csv", true),
            ("a*b*c", "aXbYbZc", true),
            ("a*b*c", "aXbYbZ", false),
            ("[]]", "]", true),
            ("[a", "[a", true),
            ("[a", "a", false),
            ("*", "", true),
            ("", "", true),
            ("?", "", false),
            ("ä?", "äö", true),
        ] {
            assert_eq!(fits(pattern, name), expected, "{pattern} {name}");
        }
        // Stars that cannot be satisfied take time that grows with the square of the name, not with its power.
        assert!(!fits(&"*a".repeat(40), &"a".repeat(39)));
    }
}
