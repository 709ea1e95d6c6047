//! Files that an identification read, and their names in messages.

use serde::{Deserialize, Serialize};

/// An input file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct InputRecord {
    /// Path as given.
    pub path: String,
    /// `robot`, `urdf` (the one that a robot file refers to), `log`, `validation`, `trajectory` or `friction`.
    pub kind: String,
    /// SHA-256 of its bytes as they were read, of a log also of those behind the last row used.
    pub sha256: String,
}

/// Name of a file without its folders.
pub fn short_name(path: &str) -> String {
    std::path::Path::new(path)
        .file_name()
        .map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}
