//! What is needed to repeat the run.

use serde::Serialize;

use super::Chosen;

/// Version, inputs, settings and seed. No time of day: the same run gives the same page, byte for byte.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Provenance {
    /// Version of the program.
    pub version: String,
    /// Files read.
    pub inputs: Vec<InputFile>,
    /// Seed of every random draw.
    pub seed: Option<u64>,
    /// Settings of the run.
    pub settings: Vec<Chosen>,
}

/// A file that was read.
#[derive(Clone, Debug, Default, Serialize)]
pub struct InputFile {
    /// Path as the user wrote it.
    pub path: String,
    /// What it is: `robot`, `training log`, `configuration`, ...; may be empty.
    pub kind: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: Option<String>,
}
