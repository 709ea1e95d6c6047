//! Where a result comes from: files as they were read, settings of a configuration.

use dynid_identify::estimate::{InputRecord, Provenance};
use serde_json::json;

use crate::config::{Config, LogConfig};

impl Config {
    /// Inputs as they were read, and the settings of a run.
    pub fn provenance(&self, inputs: Vec<InputRecord>) -> Provenance {
        Provenance { inputs, settings: self.stated(), seed: self.seed.unwrap_or(1), ..Provenance::default() }
    }

    /// Settings of a run as its configuration states them.
    pub fn stated(&self) -> serde_json::Value {
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
        let elements = &self.elements;
        let training = self.training_logs();
        let mut settings = json!({
            "gravity": self.gravity,
            "couple_mimics": self.couple_mimics.unwrap_or(false),
            "locked": self.locked,
            "elements": elements,
            "conditioning": self.conditioning,
            "estimator": self.estimator,
            "bound": self.bound,
            "preferred": self.preferred,
            "preflight": self.preflight,
            "log": training.iter().map(rows).collect::<Vec<_>>(),
            "validation": self.validation.iter().map(rows).collect::<Vec<_>>(),
        });
        if let Some(table) = &self.instruments {
            settings["instruments"] = json!(table);
        }
        if self.stiff_joints {
            settings["stiff_joints"] = json!(true);
        }
        if !self.payload.is_empty() {
            settings["payload"] = json!(self.payload);
        }
        settings
    }
}

/// An input as pages show it.
pub fn shown(input: &InputRecord) -> dynid_report::InputFile {
    let InputRecord { path, kind, sha256 } = input.clone();
    dynid_report::InputFile { path, kind: kind.word().to_owned(), sha256: Some(sha256) }
}
