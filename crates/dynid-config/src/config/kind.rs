//! Telling configurations from robot files.

use std::path::Path;

/// Whether a file means to be the configuration of a run: TOML with the key `robot`, or a damaged text with this key before its
/// first table.
///
/// Robot files in TOML have no such key, those in XML begin with `<`. A file that cannot be read is none.
pub fn is_configuration(path: &Path) -> bool {
    let Ok(text) = dynid_files::input::read_text(path) else { return false };
    if let Ok(table) = toml::from_str::<toml::Table>(&text) {
        return table.contains_key("robot");
    }
    let is_key =
        |line: &str| line.strip_prefix("robot").is_some_and(|rest| rest.trim_start().starts_with('='));
    text.trim_start_matches('\u{feff}')
        .lines()
        .map(str::trim)
        .take_while(|line| !line.starts_with(['[', '<']))
        .any(is_key)
}
