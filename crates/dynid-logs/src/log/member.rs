//! Paths that stand for more than a file: members, patterns, lists.

use std::path::Path;

use dynid_files::FileMember;

use crate::csv::LogFileError;

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
    pub(super) fn of(self, file: &FileMember, format: &'static str) -> LogFileError {
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
