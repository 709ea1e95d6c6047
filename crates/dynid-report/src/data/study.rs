//! What a report of a study is made of: claims of a published system beside what was measured here; the conventions are
//! those of [`crate::ReportData`].

use serde::Serialize;

use super::{Fact, Provenance, Value, Verdict, Warning};

/// Everything the report of one study shows. [`Default`] gives an empty report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StudyReport {
    /// Title of the page, e.g. `ER-16: nonlinear friction by metaheuristic search`.
    pub title: String,
    /// How many of the claims hold, in plain words.
    pub verdict: Verdict,
    /// What the reader should know.
    pub warnings: Vec<Warning>,
    /// What is studied and where it was published, a paragraph each.
    pub introduction: Vec<String>,
    /// Claims with what was required and measured.
    pub rows: Vec<StudyRow>,
    /// Tables and figures, in reading order.
    pub sections: Vec<StudySection>,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}

/// A claim and what became of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StudyRow {
    /// Identity within the study, e.g. `7`.
    pub id: String,
    /// What is claimed.
    pub claim: String,
    /// What is required, in words and numbers.
    pub required: String,
    /// What was measured, in words and numbers.
    pub measured: String,
    /// Whether the claim holds; `None` for a row that is not graded.
    pub pass: Option<bool>,
    /// What is measured depends on the seed.
    pub depends_on_seed: bool,
    /// Why the claim does not hold, where that is known.
    pub cause: Option<String>,
}

/// A part of the report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StudySection {
    /// Heading.
    pub title: String,
    /// Paragraphs.
    pub text: Vec<String>,
    /// Facts.
    pub facts: Vec<Fact>,
    /// Tables.
    pub tables: Vec<StudyTable>,
    /// Figures.
    pub charts: Vec<Chart>,
    /// Values of named things, drawn in the order given.
    pub rankings: Vec<Ranking>,
}

/// Values of named things, a line each with its error.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Ranking {
    /// What it shows.
    pub title: String,
    /// A sentence below it; may be empty.
    pub note: String,
    /// Unit of the values.
    pub unit: String,
    /// Lines from top to bottom.
    pub rows: Vec<Ranked>,
}

/// A line of a [`Ranking`].
#[derive(Clone, Debug, Default, Serialize)]
pub struct Ranked {
    /// What the value belongs to.
    pub name: String,
    /// Value, at least 0.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// A table: every row has one cell per heading, missing ones are left empty.
#[derive(Clone, Debug, Default, Serialize)]
pub struct StudyTable {
    /// Caption.
    pub caption: String,
    /// Headings.
    pub head: Vec<String>,
    /// Rows of cells; numbers are printed to four digits.
    pub rows: Vec<Vec<Value>>,
}

/// A line chart.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Chart {
    /// What it shows.
    pub title: String,
    /// A sentence below it; may be empty.
    pub note: String,
    /// Horizontal axis.
    pub x: ChartAxis,
    /// Vertical axis.
    pub y: ChartAxis,
    /// Same length of a unit on both axes, for paths in space.
    pub equal_units: bool,
    /// Curves, the last one on top.
    pub curves: Vec<ChartCurve>,
}

/// An axis of a [`Chart`].
#[derive(Clone, Debug, Default, Serialize)]
pub struct ChartAxis {
    /// Quantity.
    pub label: String,
    /// Unit.
    pub unit: String,
    /// Logarithmic scale; points that are not positive are not drawn then.
    pub logarithmic: bool,
}

/// A curve of a [`Chart`].
#[derive(Clone, Debug, Default, Serialize)]
pub struct ChartCurve {
    /// Name in the legend.
    pub name: String,
    /// Points in drawing order; one that is not finite breaks the curve.
    pub points: Vec<[f64; 2]>,
    /// How it is drawn.
    pub style: CurveStyle,
}

/// How a curve is drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum CurveStyle {
    /// A line.
    #[default]
    Line,
    /// A broken line: a reference.
    Dashed,
    /// A dot per point: measurements.
    Dots,
    /// A dot per point with the name of the curve beside it, in place of the legend.
    Named,
}
