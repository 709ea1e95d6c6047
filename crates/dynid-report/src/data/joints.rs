//! What a report by joints is made of, of friction experiments or drives; the conventions are those of [`crate::ReportData`].

use serde::Serialize;

use super::{Chart, ChartAxis, Fact, Provenance, Robot, Status, StudyTable, Verdict, Warning};

/// Everything a report by joints shows. [`Default`] gives an empty report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointsReport {
    /// What the page is, e.g. `Friction experiments`.
    pub kind: String,
    /// Title of the page, e.g. `Friction of indy7`.
    pub title: String,
    /// The result in plain words.
    pub verdict: Verdict,
    /// What the reader should know before using the result.
    pub warnings: Vec<Warning>,
    /// The mechanism.
    pub robot: Robot,
    /// What the numbers mean, a paragraph each.
    pub introduction: Vec<String>,
    /// A section on the whole robot before those of its joints.
    pub overview: Option<JointSection>,
    /// Sections, one per joint.
    pub joints: Vec<JointSection>,
    /// What the page is of, in place of the number of joints.
    pub counted: Option<String>,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}

/// What is told of one joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointSection {
    /// Joint.
    pub name: String,
    /// Whether the numbers may be used.
    pub status: Status,
    /// The state in a word or two.
    pub state: String,
    /// Facts.
    pub facts: Vec<Fact>,
    /// What could not be told, a sentence each.
    pub notes: Vec<String>,
    /// Tables: the numbers first.
    pub tables: Vec<StudyTable>,
    /// Measured friction and the law by temperature.
    pub curves: Option<CurvesByTemperature>,
    /// The law over speed and temperature.
    pub surface: Option<Surface>,
    /// Thermal lines, pre-sliding motion.
    pub charts: Vec<Chart>,
}

/// Curves and points that differ by temperature, coloured from cold to hot.
#[derive(Clone, Debug, Default, Serialize)]
pub struct CurvesByTemperature {
    /// What it shows.
    pub title: String,
    /// A sentence below it.
    pub note: String,
    /// Horizontal axis.
    pub x: ChartAxis,
    /// Vertical axis.
    pub y: ChartAxis,
    /// Coldest first.
    pub levels: Vec<TemperatureLevel>,
}

/// One temperature.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TemperatureLevel {
    /// °C; `None`: not known.
    pub temperature: Option<f64>,
    /// The law.
    pub curve: Vec<[f64; 2]>,
    /// Measured points with standard errors: `[x, y, std]`.
    pub points: Vec<[f64; 3]>,
}

/// A quantity over two others, on a grid.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Surface {
    /// What it shows.
    pub title: String,
    /// A sentence below it.
    pub note: String,
    /// Horizontal axis.
    pub x: ChartAxis,
    /// Vertical axis.
    pub y: ChartAxis,
    /// The quantity.
    pub value: ChartAxis,
    /// Grid, ascending.
    pub xs: Vec<f64>,
    /// Grid, ascending.
    pub ys: Vec<f64>,
    /// Values, a list along `xs` for each of `ys`.
    pub values: Vec<Vec<f64>>,
    /// Where it was measured.
    pub points: Vec<[f64; 2]>,
}
