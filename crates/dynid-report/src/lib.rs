//! Reports: one HTML file that tells a customer what was identified and how far it can be trusted, another that shows a
//! designed trajectory and what its log will tell, others that hold the claims of a study against what was measured and that
//! say what is wrong with a log.
//!
//! Fill a [`ReportData`], a [`DesignReport`] or a [`StudyReport`], call [`render`], [`render_design`] or [`render_study`], write the text to a file. The crate
//! knows nothing of models or estimators, and a page needs nothing but a browser: no network, no second file.
//!
//! # Why the plots are our own
//!
//! Measured against the needs (offline, zoomable, printable, under 4 MB with the data of a 7-axis log):
//!
//! | choice | bytes in the page before data | verdict |
//! |---|---|---|
//! | `plotly` 0.14.1, embedded | 4.65 MB | over the limit by itself |
//! | `charming` 0.6.0 | 1.03 MB | its HTML renderer loads the script from a network address; the copy of the script it ships is reachable only through its server-side feature, which embeds a JavaScript engine |
//! | `template/plot.js` | 12 kB | drawn as SVG: zoom, pan, read-out, prints as vectors |
//!
//! The curves are drawn by the script from decimated series (least and greatest sample of each bucket), the still
//! pictures (histogram, autocorrelation, 95 % interval, paths of frames) by Rust, so that they are there without a script
//! too.

mod data;
mod drawing;
mod error;
mod markup;
mod number;
mod page;
mod series;

pub use data::{
    BaseParameter, CarriedReason, Caution, Chart, ChartAxis, ChartCurve, Check, Chosen, ConfoundedPair,
    Consistency, ConsistencyForm, ConsistencyStatus, Counts, CurveStyle, DesignJoint, DesignParameter,
    DesignQuality, DesignReport, DesignStart, Fact, FileJoint, FileJudgement, FileLoss, FramePath,
    FrictionTrial, HeldOut, HeldOutJoint, InputFile, IntervalForecast, Joint, JointDelay, JointMotion,
    JointQuality, JointSeries, Ladder, Limit, LimitUse, LogReport, LogRole, LogSeries, LogWhiteness,
    Observation, Obstacle, Origin, OwnerKind, ParameterShare, ParameterVerdict, Precision, Provenance,
    Pruning, PruningStep, Quality, RandomMotion, ReportData, Robot, Rung, Shape, ShapeParameter,
    ShapeVerdict, StandardParameter, Starts, Status, StudyReport, StudyRow, StudySection, StudyTable,
    Trajectory, UnidentifiableColumn, ValidationPrice, Value, Verdict, Warning, Whiteness,
};
pub use data::{CurvesByTemperature, JointSection, JointsReport, Surface, TemperatureLevel};
pub use data::{FindingRow, LogPage, Ranked, Ranking};
pub use data::{Judged, LineKind, PictureLine, PointKind, Pose, RobotPicture};
pub use error::ReportError;
pub use page::{render, render_design, render_joints, render_kind, render_log_page, render_study};
