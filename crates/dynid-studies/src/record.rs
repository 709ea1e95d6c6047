//! The rows of a study, for programs.

use dynid::report::{Chosen, Provenance, Status, StudyReport, StudyRow, StudySection, Verdict};
use dynid_terminal::study::Published;
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
    /// What is measured, in words.
    #[serde(skip)]
    pub words: String,
    /// Whether the claim holds; `None` for a row that stands beside another one and is not graded.
    pub pass: Option<bool>,
    /// Noise, starts or searches of the seed enter what is measured.
    pub depends_on_seed: bool,
    /// Why the row fails, where it does and the cause is known.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cause: Option<String>,
}

impl Row {
    /// A graded row; `words` say in the report what `measured` says to programs.
    pub fn new(id: &str, claim: &str, required: &str, measured: Json, words: String, pass: bool) -> Self {
        let row = Row::beside(id, claim, required, measured, words);
        Row { pass: Some(pass), ..row }
    }

    /// A row that is shown and not graded; `beside` says beside what it stands.
    pub fn beside(id: &str, claim: &str, beside: &str, measured: Json, words: String) -> Self {
        let (id, claim, required) = (id.into(), claim.into(), beside.into());
        Row { id, claim, required, measured, words, pass: None, depends_on_seed: false, cause: None }
    }

    /// Whether the row is graded and its claim does not hold.
    pub fn fails(&self) -> bool {
        self.pass == Some(false)
    }
}

/// A row that the seed enters.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Drawn {
    /// Identity of the row.
    pub(crate) id: &'static str,
    /// Why it fails with the seeds with which it does; empty if none is known.
    pub(crate) cause: &'static str,
}

/// A row that the seed enters and that holds with every seed tried.
pub(crate) const fn drawn(id: &'static str) -> Drawn {
    Drawn { id, cause: "" }
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
    /// A record of rows, by number and then by letter; `drawn` are those that the seed enters.
    pub(crate) fn new(
        study: &str,
        settings: &crate::RunSettings,
        mut rows: Vec<Row>,
        drawn: &[Drawn],
    ) -> Self {
        // `B11'` stands behind `B11`.
        let number = |row: &Row| row.id.trim_matches(['B', '\'']).parse::<u32>().unwrap_or(u32::MAX);
        rows.sort_by_key(|row| (number(row), row.id.clone()));
        for row in &mut rows {
            let Some(known) = drawn.iter().find(|d| d.id == row.id) else { continue };
            row.depends_on_seed = true;
            row.cause = (row.fails() && !known.cause.is_empty()).then(|| known.cause.to_owned());
        }
        StudyRecord {
            study: study.to_owned(),
            version: dynid::VERSION.to_owned(),
            seed: settings.seed,
            quick: settings.quick,
            pass: !rows.iter().any(Row::fails),
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

    /// The page of the study: verdict and rows, what it is about, its tables and figures.
    pub(crate) fn page(
        &self,
        study: Published,
        introduction: &[&str],
        sections: Vec<StudySection>,
    ) -> StudyReport {
        let row = |r: &Row| StudyRow {
            id: r.id.clone(),
            claim: r.claim.clone(),
            required: r.required.clone(),
            measured: r.words.clone(),
            pass: r.pass,
            depends_on_seed: r.depends_on_seed,
            cause: r.cause.clone(),
        };
        StudyReport {
            title: study.title.into(),
            verdict: self.verdict(),
            warnings: Vec::new(),
            introduction: introduction.iter().map(|words| (*words).to_owned()).collect(),
            rows: self.rows.iter().map(row).collect(),
            sections,
            provenance: Provenance {
                version: dynid::VERSION.into(),
                seed: Some(self.seed),
                settings: vec![Chosen::given("quick run", self.quick, "")],
                ..Provenance::default()
            },
        }
    }

    /// How many rows hold, in words.
    pub fn verdict(&self) -> Verdict {
        let failed: Vec<&str> = self.rows.iter().filter(|r| r.fails()).map(|r| r.id.as_str()).collect();
        let graded = self.rows.iter().filter(|r| r.pass.is_some()).count();
        let (status, headline) = match failed[..] {
            [] => (Status::Ok, format!("All {graded} claims hold")),
            [one] => (Status::Fail, format!("Row {one} of {graded} does not hold")),
            _ => (Status::Fail, format!("Rows {} of {graded} do not hold", failed.join(", "))),
        };
        let drawn: Vec<&str> =
            self.rows.iter().filter(|r| r.depends_on_seed).map(|r| r.id.as_str()).collect();
        let mut sentences = Vec::new();
        if !drawn.is_empty() {
            sentences.push(format!(
                "What is measured in rows {} depends on the seed, here {}; the other rows are the same with every seed.",
                drawn.join(", "),
                self.seed
            ));
        }
        if self.quick {
            sentences.push("Statistics are shrunk: a quick run.".to_owned());
        }
        Verdict { status, headline, sentences, ..Verdict::default() }
    }
}
