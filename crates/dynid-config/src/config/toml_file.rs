//! Configurations as TOML files.

use std::path::{Path, PathBuf};

use dynid_files::input::toml_message;
use dynid_identify::Error;
use serde::de::DeserializeOwned;

/// Reads and parses a configuration; with the folder that paths in it are relative to.
///
/// # Errors
/// [`Error::Read`], and those of `parse`.
pub fn read<T>(
    path: &Path,
    parse: impl FnOnce(&str, &str) -> Result<T, Error>,
) -> Result<(T, PathBuf), Error> {
    let text = dynid_files::input::read_text(path)
        .map_err(|source| Error::Read { file: path.to_owned(), source })?;
    let config = parse(&text, &path.display().to_string())?;
    Ok((config, path.parent().unwrap_or(Path::new("")).to_owned()))
}

/// Values of a TOML text.
///
/// # Errors
/// [`Error::Config`] with the line.
pub fn parse<T: DeserializeOwned>(text: &str, file: &str) -> Result<T, Error> {
    toml::from_str(text).map_err(|e| Error::Config {
        file: file.to_owned(),
        line: e.span().map(|s| 1 + text[..s.start.min(text.len())].matches('\n').count()),
        message: toml_message(e.message().lines().next().unwrap_or_default(), text, e.span()),
    })
}

/// The error for something that a configuration has to state.
pub fn missing(file: &str, what: &str) -> Error {
    Error::Config { file: file.to_owned(), line: None, message: format!("expected {what}") }
}

/// Names the file in which a check found a fault.
pub fn in_file(file: &str, checked: Result<(), Error>) -> Result<(), Error> {
    checked.map_err(|e| Error::InFile { file: file.to_owned(), source: Box::new(e) })
}
