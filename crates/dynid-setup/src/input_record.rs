//! Files that an identification read, and their names in messages.

use dynid_files::SourceFile;
use serde::{Deserialize, Serialize};

dynid_record::words! {
    /// What a run read a file as.
    InputKind {
        /// The robot file.
        Robot = "robot",
        /// The URDF that a robot file refers to.
        Urdf = "urdf",
        /// A file that the robot file includes.
        Included = "included",
        /// A mesh of a link.
        Mesh = "mesh",
        /// A log that the result rests on.
        Log = "log",
        /// A log that the result is judged on.
        Validation = "validation",
        /// A log of motion within friction.
        Presliding = "presliding",
        /// A trajectory.
        Trajectory = "trajectory",
        /// Known friction.
        Friction = "friction",
        /// What was found of drives.
        Drives = "drives",
    }
}

/// An input file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct InputRecord {
    /// Path as given.
    pub path: String,
    /// What it was read as.
    pub kind: InputKind,
    /// SHA-256 of its bytes as they were read, of a log also of those behind the last row used.
    pub sha256: String,
}

impl InputRecord {
    /// A file that was read.
    pub fn of(kind: InputKind, source: &SourceFile) -> Self {
        let SourceFile { path, sha256 } = source.clone();
        InputRecord { path, kind, sha256 }
    }
}

/// Name of a file without its folders.
pub fn short_name(path: &str) -> String {
    std::path::Path::new(path)
        .file_name()
        .map_or_else(|| path.to_owned(), |n| n.to_string_lossy().into_owned())
}
