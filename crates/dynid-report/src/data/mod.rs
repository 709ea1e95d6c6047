//! What a report is made of: plain, serialisable data, filled by whoever ran the identification.
//!
//! Conventions, for every structure below:
//!
//! - a number that is undefined for this run is `None` and is printed as `-`; a number that is present but not
//!   finite is printed as `not finite`, so that it is seen rather than passed over;
//! - units are SI and angles rad; where a field's name does not end in its unit, a `unit` field beside it says it,
//!   an empty `unit` meaning "dimensionless";
//! - a `Vec` documented "per joint" has one entry per entry of [`ReportData::joints`], in that order, or is empty
//!   when nothing is known; any other length is a [`crate::ReportError::Length`];
//! - every text may hold any character: the page escapes it.

mod caution;
mod conditioning;
mod consistency;
mod design;
mod files;
mod first;
mod friction;
mod joints;
mod log;
mod log_page;
mod parameters;
mod picture;
mod precision;
mod provenance;
mod pruning;
mod study;
mod verdict;

pub use caution::{Caution, Counts};
pub use conditioning::{Chosen, JointDelay, Ladder, Observation, Origin, Rung, UnidentifiableColumn};
pub use consistency::{
    Consistency, ConsistencyForm, ConsistencyStatus, HeldOut, HeldOutJoint, Limit, ValidationPrice,
};
pub use design::{
    ConfoundedPair, DesignJoint, DesignParameter, DesignQuality, DesignReport, DesignStart, FramePath,
    IntervalForecast, JointMotion, LimitUse, Obstacle, ParameterShare, RandomMotion, Shape, Starts,
    Trajectory,
};
pub use files::{FileJoint, FileJudgement, FileLoss};
pub use first::Judged;
pub use friction::{FrictionTrial, ShapeParameter, ShapeVerdict};
pub use joints::{CurvesByTemperature, JointSection, JointsReport, Surface, TemperatureLevel};
pub use log::{JointQuality, JointSeries, LogReport, LogRole, LogSeries, Quality};
pub use log_page::{FindingRow, LogPage};
pub use parameters::{BaseParameter, CarriedReason, OwnerKind, ParameterVerdict, StandardParameter};
pub use picture::{LineKind, PictureLine, PointKind, Pose, RobotPicture};
pub use precision::{LogWhiteness, Precision, Whiteness};
pub use provenance::{InputFile, Provenance};
pub use pruning::{Pruning, PruningStep};
pub use study::{
    Chart, ChartAxis, ChartCurve, CurveStyle, Ranked, Ranking, StudyReport, StudyRow, StudySection,
    StudyTable,
};
pub use verdict::{Check, Status, Verdict, Warning};

use crate::number;
use serde::Serialize;

/// Everything one report shows.
///
/// Every list may be empty: its section then says so in words or is left out. [`Default`] gives an empty report.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ReportData {
    /// Title of the page, e.g. `Identification of indy7`.
    pub title: String,
    /// The result in plain words.
    pub verdict: Verdict,
    /// What the reader should look at before using the result, the worst first, each with what mends it.
    pub cautions: Vec<Caution>,
    /// How many parameters there are; the lists of parameters have as many entries.
    pub counts: Counts,
    /// The log that the result is judged by; `None` leaves the errors out of the first screen.
    pub judged: Option<Judged>,
    /// The robot in the poses of a log; `None` leaves the picture out.
    pub picture: Option<RobotPicture>,
    /// The mechanism that was identified.
    pub robot: Robot,
    /// The actuated joints; their order is the order of every "per joint" list.
    pub joints: Vec<Joint>,
    /// Training logs first, then validation logs.
    pub logs: Vec<LogReport>,
    /// How the parameters were estimated: method, weighting, constraints, iterations, margin of feasibility, ...
    pub estimation: Vec<Fact>,
    /// Minimal identifiable combinations of the standard parameters.
    pub base_parameters: Vec<BaseParameter>,
    /// Parameters per link and joint.
    pub standard_parameters: Vec<StandardParameter>,
    /// Parameters that enter the effort nonlinearly.
    pub shape_parameters: Vec<ShapeParameter>,
    /// Effort of friction over velocity, a chart per joint whose law is not linear in its parameters.
    pub friction_laws: Vec<Chart>,
    /// Robot files beside the model; `None` where files do not hold its efforts.
    pub files: Option<FileJudgement>,
    /// Motions that would reveal what the logs do not, most helpful first, a sentence each.
    pub motions: Vec<String>,
    /// Physical consistency and its price; `None` if none was asked for.
    pub consistency: Option<Consistency>,
    /// Errors on held-out parts of the training logs.
    pub held_out: HeldOut,
    /// How the residuals bear on the precision.
    pub precision: Option<Precision>,
    /// Searches over all parameters; `None` if none was asked for.
    pub searches: Option<StudySection>,
    /// Models with fewer base parameters.
    pub pruning: Option<Pruning>,
    /// Size, rank and condition of the observation matrix.
    pub observation: Observation,
    /// Columns of the observation matrix that no motion of this mechanism can excite.
    pub unidentifiable: Vec<UnidentifiableColumn>,
    /// Every setting that decided how the logs were conditioned before estimation.
    pub conditioning: Vec<Chosen>,
    /// Candidate settings that were compared, with their losses: mask ladder, kernel ladder, ...
    pub ladders: Vec<Ladder>,
    /// Friction shapes that were tried, joint by joint.
    pub friction_trials: Vec<FrictionTrial>,
    /// Per joint: delay between measured position and measured effort.
    pub delays: Vec<JointDelay>,
    /// What is needed to repeat the run.
    pub provenance: Provenance,
}

/// The mechanism.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Robot {
    /// Name given by the robot file.
    pub name: String,
    /// File it was described in, as the user wrote it.
    pub file: Option<String>,
    /// Further facts: degrees of freedom, gravity, convention of the link frames, number of links, ...
    pub facts: Vec<Fact>,
}

/// An actuated joint.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Joint {
    /// Name given by the robot file.
    pub name: String,
    /// Unit of its effort: `N m` for a revolute joint, `N` for a prismatic one.
    pub effort_unit: String,
    /// Kind, e.g. `revolute`; may be empty.
    pub kind: String,
    /// Elements that act at the joint, e.g. `viscous friction`, `Coulomb friction`, `rotor inertia`.
    pub elements: Vec<String>,
}

/// A named value.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Fact {
    /// What it is.
    pub name: String,
    /// Value of the fact.
    pub value: Value,
    /// Unit of the value; empty if dimensionless or text.
    pub unit: String,
}

impl Fact {
    /// A fact from its parts.
    pub fn new(name: impl Into<String>, value: impl Into<Value>, unit: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into(), unit: unit.into() }
    }
}

/// A value of a setting or fact.
///
/// Serialises to a bare number, boolean, text or null.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// Undefined; printed as `-`.
    #[default]
    Undefined,
    /// A count; printed exactly.
    Count(u64),
    /// A physical number; printed with about four significant digits.
    Number(f64),
    /// A switch; printed as `yes` or `no`.
    Flag(bool),
    /// Anything else.
    Text(String),
}

impl Value {
    /// An interval as text, its ends to two digits of its half width; undefined if there is none.
    pub fn interval(interval: Option<(f64, f64)>) -> Self {
        interval.map_or(Value::Undefined, |(low, high)| {
            let (low, high) = number::interval(low, high);
            Value::Text(format!("{low} to {high}"))
        })
    }
}

impl From<f64> for Value {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<Option<f64>> for Value {
    fn from(number: Option<f64>) -> Self {
        number.map_or(Self::Undefined, Self::Number)
    }
}

impl From<u64> for Value {
    fn from(count: u64) -> Self {
        Self::Count(count)
    }
}

impl From<Option<u64>> for Value {
    fn from(count: Option<u64>) -> Self {
        count.map_or(Self::Undefined, Self::Count)
    }
}

impl From<usize> for Value {
    fn from(count: usize) -> Self {
        Self::Count(count as u64)
    }
}

impl From<bool> for Value {
    fn from(flag: bool) -> Self {
        Self::Flag(flag)
    }
}

impl From<&str> for Value {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Value {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}
