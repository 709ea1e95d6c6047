//! What a page about logs is made of: findings of a pre-flight, a comparison of estimators; the conventions are those of
//! [`crate::ReportData`].

use serde::Serialize;

use super::{Provenance, Status, StudySection, Verdict};

/// Everything a page about logs shows. [`Default`] gives an empty one.
#[derive(Clone, Debug, Default, Serialize)]
pub struct LogPage {
    /// What kind of page it is, e.g. `Pre-flight`.
    pub kind: String,
    /// Title.
    pub title: String,
    /// Robot.
    pub robot: String,
    /// Outcome in plain words.
    pub verdict: Verdict,
    /// Paragraphs.
    pub introduction: Vec<String>,
    /// Findings, the worst first; may be empty.
    pub findings: Vec<FindingRow>,
    /// Tables and figures, in reading order.
    pub sections: Vec<StudySection>,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}

/// A finding.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FindingRow {
    /// How much it matters.
    pub status: Status,
    /// What it is.
    pub name: String,
    /// Log.
    pub log: String,
    /// Joint; may be empty.
    pub joint: String,
    /// What was measured.
    pub evidence: String,
    /// What to do.
    pub remedy: String,
}
