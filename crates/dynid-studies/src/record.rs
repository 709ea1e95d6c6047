//! The rows of a study, for programs.

use dynid::report::{Status, StudyRow, Verdict};
use serde::Serialize;
use serde_json::Value as Json;

/// A claim, what it requires and what was measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// Identity within the study.
    pub id: String,
    /// What is claimed.
    pub claim: String,
    /// What is required, in words and numbers.
    pub required: String,
    /// Numbers measured, by name.
    pub measured: Json,
    /// The same in words.
    #[serde(skip)]
    pub words: String,
    /// Whether the claim holds.
    pub pass: bool,
}

impl Row {
    /// A row; `words` say in the report what `measured` says to programs.
    pub fn new(id: &str, claim: &str, required: &str, measured: Json, words: String, pass: bool) -> Self {
        Row { id: id.into(), claim: claim.into(), required: required.into(), measured, words, pass }
    }
}

/// What `dynid study NAME --json` prints; keys are added, never renamed.
#[derive(Debug, Clone, Serialize)]
pub struct StudyRecord {
    /// Name of the study.
    pub study: String,
    /// Version of the program.
    pub version: String,
    /// Seed.
    pub seed: u64,
    /// Statistics were shrunk.
    pub quick: bool,
    /// Every acceptance row.
    pub rows: Vec<Row>,
    /// Whether all hold.
    pub pass: bool,
}

impl StudyRecord {
    /// A record of rows.
    pub fn new(study: &str, settings: &crate::RunSettings, rows: Vec<Row>) -> Self {
        StudyRecord {
            study: study.to_owned(),
            version: dynid::VERSION.to_owned(),
            seed: settings.seed,
            quick: settings.quick,
            pass: rows.iter().all(|r| r.pass),
            rows,
        }
    }

    /// The record's text.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self)
            .unwrap_or_else(|e| unreachable!("a record holds only plain data: {e}"));
        text.push('\n');
        text
    }

    /// The rows as the report shows them.
    pub fn report_rows(&self) -> Vec<StudyRow> {
        self.rows
            .iter()
            .map(|r| StudyRow {
                id: r.id.clone(),
                claim: r.claim.clone(),
                required: r.required.clone(),
                measured: r.words.clone(),
                pass: r.pass,
            })
            .collect()
    }

    /// How many rows hold, in words.
    pub fn verdict(&self) -> Verdict {
        let failed: Vec<&str> = self.rows.iter().filter(|r| !r.pass).map(|r| r.id.as_str()).collect();
        let (status, headline) = match failed[..] {
            [] => (Status::Ok, format!("All {} claims hold", self.rows.len())),
            [one] => (Status::Fail, format!("Row {one} of {} does not hold", self.rows.len())),
            _ => (Status::Fail, format!("Rows {} of {} do not hold", failed.join(", "), self.rows.len())),
        };
        let sentences = match self.quick {
            true => vec!["Statistics are shrunk: a quick run.".to_owned()],
            false => Vec::new(),
        };
        Verdict { status, headline, sentences, ..Verdict::default() }
    }
}
