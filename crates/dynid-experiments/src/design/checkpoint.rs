//! Finished starts of a design on disk, so that a run can be taken up again.

use std::path::Path;

use dynid_config::sealed;
use dynid_excitation::StartOutcome;
use dynid_files::SourceFile;
use dynid_identify::Error;
use serde::{Deserialize, Serialize};

use super::DesignConfig;

const SCHEMA: &str = "dynid-design-checkpoint/2";

#[derive(Debug, Serialize, Deserialize, schemars::JsonSchema)]
struct Checkpoint {
    schema: String,
    /// What the starts depend on.
    problem: String,
    starts: Vec<StartRecord>,
}

#[derive(Debug, Serialize, Deserialize, schemars::JsonSchema)]
struct StartRecord {
    seed: u64,
    unknowns: Vec<f64>,
    criterion: Option<f64>,
    excess: f64,
    evaluations: usize,
    share: f64,
}

/// Text that differs between problems whose starts differ: robot, settings, version. The number of starts and the time
/// budget do not matter.
pub(super) fn fingerprint(config: &DesignConfig, meshes: &[SourceFile]) -> Result<String, Error> {
    let mut config = config.clone();
    config.search.starts = 1;
    config.search.time_budget_s = None;
    config.search.checkpoint = None;
    config.out = None;
    config.trajectory.parking = None;
    config.trajectory.frames.clear();
    let robot = dynid_config::logs::sha256(&config.robot)?;
    let mut text = format!("{} {robot}", dynid_identify::VERSION);
    for earlier in std::mem::take(&mut config.earlier) {
        text += &dynid_config::logs::sha256(&earlier)?;
    }
    // What meshes hold matters, not where they are.
    config.package_dirs.clear();
    for mesh in meshes {
        text += &format!(" {}", mesh.sha256);
    }
    config.robot = std::path::PathBuf::new();
    let settings = serde_json::to_string(&config).unwrap_or_else(|_| format!("{config:?}"));
    Ok(format!("{text} {settings}"))
}

/// Starts of an earlier run of the same problem; none if the file does not exist yet.
pub(super) fn read(path: &Path, fingerprint: &str) -> Result<Vec<StartOutcome>, Error> {
    let Some(text) = sealed::read(path, SCHEMA)? else { return Ok(Vec::new()) };
    let fault = |message: String| Error::Checkpoint { file: path.display().to_string(), message };
    let checkpoint: Checkpoint = serde_json::from_str(&text).map_err(|e| fault(e.to_string()))?;
    if checkpoint.schema != SCHEMA {
        return Err(fault(format!("expected schema {SCHEMA}, found {}", checkpoint.schema)));
    }
    if checkpoint.problem != fingerprint {
        return Err(fault("robot, settings or version differ from those it was made with".to_owned()));
    }
    let outcome = |s: StartRecord| StartOutcome {
        seed: s.seed,
        unknowns: s.unknowns,
        criterion: s.criterion,
        excess: s.excess,
        evaluations: s.evaluations,
        share: s.share,
        cut: false,
    };
    Ok(checkpoint.starts.into_iter().map(outcome).collect())
}

/// Writes all finished starts.
pub(super) fn write(path: &Path, fingerprint: &str, starts: &[StartOutcome]) -> Result<(), Error> {
    let record = |s: &StartOutcome| StartRecord {
        seed: s.seed,
        unknowns: s.unknowns.clone(),
        criterion: s.criterion,
        excess: s.excess,
        evaluations: s.evaluations,
        share: s.share,
    };
    let checkpoint = Checkpoint {
        schema: SCHEMA.to_owned(),
        problem: fingerprint.to_owned(),
        starts: starts.iter().map(record).collect(),
    };
    let text = serde_json::to_string_pretty(&checkpoint)
        .map_err(|e| Error::Checkpoint { file: path.display().to_string(), message: e.to_string() })?;
    sealed::write(path, &(text + "\n"))
}
