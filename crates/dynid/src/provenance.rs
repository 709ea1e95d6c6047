//! Where a result comes from: files as they were read, how logs were read, settings.

use dynid_io::{MappingSpec, SourceFile};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::config::{Config, LogConfig, MotorSide};
use crate::estimate::{InputRecord, Provenance};
use crate::logs::LoadedLog;
use crate::robot::Robot;

/// How the training logs were read, for logs of the same kind to be read alike.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct ReadingRecord {
    /// Columns as the run stated them, drive gains included; what it does not state is found by name. Where all training
    /// logs state the same columns of their own, these.
    pub columns: MappingSpec,
    /// Transmission between logged motors and joints.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motor_side: Option<MotorSide>,
    /// How the columns of every training log were understood: signal, columns.
    pub understood: Vec<Vec<(String, String)>>,
}

impl ReadingRecord {
    pub(crate) fn of(config: &Config, understood: &[Vec<(String, String)>]) -> Self {
        let mut own = config.log.iter().map(|log| log.columns.as_ref().unwrap_or(&config.columns));
        let columns = match own.next() {
            Some(first) if own.all(|other| other == first) => first,
            _ => &config.columns,
        };
        ReadingRecord {
            columns: columns.clone(),
            motor_side: config.motor_side.clone(),
            understood: understood.to_vec(),
        }
    }

    /// Whether the run stated columns, and did not leave all of them to their names.
    pub fn states_columns(&self) -> bool {
        self.columns != MappingSpec::default()
    }
}

impl InputRecord {
    /// A file that was read.
    pub(crate) fn of(kind: &str, source: &SourceFile) -> Self {
        let SourceFile { path, sha256 } = source.clone();
        InputRecord { path, kind: kind.to_owned(), sha256 }
    }

    /// A robot file, and the URDF that it refers to.
    pub(crate) fn of_robot(robot: &Robot) -> Vec<Self> {
        let kinds = ["robot", "urdf"];
        robot.file.sources.iter().zip(kinds).map(|(source, kind)| InputRecord::of(kind, source)).collect()
    }

    /// The input as pages show it.
    pub(crate) fn shown(&self) -> dynid_report::InputFile {
        let InputRecord { path, kind, sha256 } = self.clone();
        dynid_report::InputFile { path, kind, sha256: Some(sha256) }
    }

    /// Logs with their trajectories.
    pub(crate) fn of_logs(loaded: &[LoadedLog]) -> impl Iterator<Item = Self> {
        loaded.iter().flat_map(|log| log.inputs.clone())
    }
}

/// Inputs as they were read, and the settings of a run.
pub(crate) fn provenance(config: &Config, inputs: Vec<InputRecord>) -> Provenance {
    let rows = |l: &LogConfig| {
        let mut value = json!({ "path": l.path, "rows": l.rows, "part": l.part });
        if l.trajectory.is_some() || l.period_s.is_some() {
            value["trajectory"] = json!(l.trajectory);
            value["period_s"] = json!(l.period_s);
        }
        for (key, own) in [("name", &l.name), ("payload", &l.payload), ("like", &l.like)] {
            if let Some(own) = own {
                value[key] = json!(own);
            }
        }
        if !l.own.is_empty() {
            value["own"] = json!(l.own);
        }
        value
    };
    let elements = &config.elements;
    let training = config.training_logs();
    let mut settings = json!({
        "gravity": config.gravity,
        "couple_mimics": config.couple_mimics.unwrap_or(false),
        "locked": config.locked,
        "elements": elements,
        "conditioning": config.conditioning,
        "estimator": config.estimator,
        "bound": config.bound,
        "preferred": config.preferred,
        "preflight": config.preflight,
        "log": training.iter().map(rows).collect::<Vec<_>>(),
        "validation": config.validation.iter().map(rows).collect::<Vec<_>>(),
    });
    if let Some(table) = &config.instruments {
        settings["instruments"] = json!(table);
    }
    if !config.payload.is_empty() {
        settings["payload"] = json!(config.payload);
    }
    Provenance { inputs, settings, seed: config.seed.unwrap_or(1), ..Provenance::default() }
}
