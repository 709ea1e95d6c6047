//! Who wrote a file that is about to be replaced.
//!
//! Every file that dynid writes says so, where its format has a place for it: JSON by its schema or provenance, pages by their generator,
//! XML, TOML and compressed tables by a comment. Plain tables (CSV) and messages for robots (YAML) have no such place; efforts alone, as
//! `predict` writes them, are nobody's log.

use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use serde_json::Value;

/// What comments say.
const MARK: &str = dynid::io::csv::GZIP_COMMENT;
/// What pages say.
const GENERATOR: &str = "name=\"generator\" content=\"dynid";
/// Bytes at both ends of a file in which a mark is looked for.
const ENDS: u64 = 4096;

/// Where a file comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Origin {
    /// It does not exist, is empty or no regular file (a pipe), or says that dynid wrote it.
    Dynid,
    /// Its format has no place for a mark.
    Unmarked,
    /// It could say so and does not.
    Foreign,
}

impl Origin {
    /// Looks at a file.
    pub(super) fn of(path: &Path) -> Origin {
        match path.metadata() {
            Ok(found) if found.is_file() && found.len() > 0 => {}
            _ => return Origin::Dynid,
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
        let is = |ending: &str| name.ends_with(ending);
        let marked = match () {
            () if is(".csv") && has_efforts_alone(path) => true,
            () if [".csv", ".yaml", ".ros2.json"].iter().any(|e| is(e)) => return Origin::Unmarked,
            () if dynid::reduce::is_factor_file(path) => true,
            () if is(".json") => is_result(path),
            () => ends(path).is_ok_and(|text| text.contains(MARK) || text.contains(GENERATOR)),
        };
        if marked { Origin::Dynid } else { Origin::Foreign }
    }
}

/// Whether a table is of predicted efforts, which no robot logs.
fn has_efforts_alone(path: &Path) -> bool {
    let Ok(text) = ends(path) else { return false };
    text.lines().next().is_some_and(|header| header.split(',').all(|name| name.starts_with("effort_")))
}

/// Whether a JSON file is a result of this program.
fn is_result(path: &Path) -> bool {
    let Ok(text) = dynid::io::input::read(path) else { return false };
    let Ok(found) = serde_json::from_slice::<Value>(&text) else { return false };
    let starts = |key: &str, with: &str| found[key].as_str().is_some_and(|s| s.starts_with(with));
    let is_study = found["study"].is_string() && found["version"].is_string() && found["rows"].is_array();
    found["provenance"]["version"].is_string()
        || starts("schema", "dynid-")
        || starts("format", "dynid-")
        || is_study
}

/// The beginning and the end of a file as text.
fn ends(path: &Path) -> std::io::Result<String> {
    let mut file = File::open(path)?;
    let mut bytes = Vec::new();
    (&mut file).take(ENDS).read_to_end(&mut bytes)?;
    let length = file.metadata()?.len();
    file.seek(SeekFrom::Start(length.saturating_sub(ENDS)))?;
    file.take(ENDS).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// An XML text with a comment at its end that says who wrote it; all else stays byte for byte.
pub fn marked_xml(text: &str) -> String {
    if text.contains(MARK) {
        return text.to_owned();
    }
    let end = if text.ends_with('\n') { "" } else { "\n" };
    format!("{text}{end}<!-- {MARK} -->\n")
}

/// A TOML text with a comment at its beginning that says who wrote it.
pub fn marked_toml(text: &str) -> String {
    if text.contains(MARK) { text.to_owned() } else { format!("# {MARK}\n{text}") }
}

/// A manual page with a comment at its end that says who wrote it.
pub fn marked_roff(mut page: Vec<u8>) -> Vec<u8> {
    page.extend_from_slice(format!(".\\\" {MARK}\n").as_bytes());
    page
}
