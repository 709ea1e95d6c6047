//! Paths that stand for more than a file: `FILE#MEMBER`, patterns, lists.

use std::path::{Path, PathBuf};

use crate::csv::LogFileError;

/// A file that may hold a log, and the member of it that is meant.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogFile {
    /// File, or folder of a dataset.
    pub path: PathBuf,
    /// Member, such as the number of an episode, the path of a group, or topics.
    pub member: Option<String>,
}

impl LogFile {
    /// Takes `FILE#MEMBER` apart, unless there is a file of the whole name.
    pub fn of(path: &Path) -> Self {
        let whole = LogFile { path: path.to_owned(), member: None };
        let Some((file, member)) = path.to_str().and_then(|text| text.rsplit_once('#')) else { return whole };
        if path.exists() || file.is_empty() {
            return whole;
        }
        LogFile { path: file.into(), member: Some(member.to_owned()) }
    }
}

/// Whether a file is called as lists of logs are.
pub(super) fn is_manifest(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("manifest"))
}

/// Whether a path is a pattern: it has its characters, and no file has its name.
pub(super) fn is_pattern(path: &Path) -> bool {
    has_pattern(&path.to_string_lossy()) && !path.exists()
}

/// Whether a text has the characters of a pattern.
pub(super) fn has_pattern(text: &str) -> bool {
    text.contains(['*', '?', '['])
}

/// Why a file of a known format cannot be opened.
#[derive(Debug)]
pub(super) enum OpenFault {
    /// It is broken.
    Damaged(String),
    /// It has several members, or not the one that was asked for.
    Member {
        /// Members that there are.
        expected: String,
        /// Member that was asked for.
        found: String,
        /// A member, if there is any.
        example: Option<String>,
    },
}

impl OpenFault {
    pub(super) fn of(self, file: &LogFile, format: &'static str) -> LogFileError {
        let path = file.path.display().to_string();
        match self {
            OpenFault::Damaged(reason) => LogFileError::Damaged { file: path, format, reason },
            OpenFault::Member { expected, found, example } => {
                let example = example.map_or_else(|| path.clone(), |member| format!("{path}#{member}"));
                LogFileError::Member {
                    file: path,
                    format,
                    expected: expected.into(),
                    found: found.into(),
                    example: example.into(),
                }
            }
        }
    }
}
