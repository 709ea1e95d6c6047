//! The first screen: errors per joint and one joint drawn.

use serde::Serialize;

use crate::data::{Judged, LogReport, ReportData};
use crate::drawing::versus;
use crate::error::ReportError;

#[derive(Debug, Serialize)]
pub(super) struct FirstView<'a> {
    log: &'a str,
    unseen: bool,
    others: usize,
    rows: Vec<Row<'a>>,
    /// Over all joints.
    percent: Option<f64>,
    joint: &'a str,
    unit: &'a str,
    why: &'a str,
    description: &'a str,
    /// Curves; empty if there is nothing to draw.
    svg: String,
    across: Vec<(f64, String)>,
    down: Vec<(f64, String)>,
}

#[derive(Debug, Serialize)]
struct Row<'a> {
    name: &'a str,
    unit: &'a str,
    rms: Option<f64>,
    percent: Option<f64>,
    r2: Option<f64>,
    correlation: Option<f64>,
}

pub(super) fn first(data: &ReportData) -> Option<FirstView<'_>> {
    let judged = data.judged.as_ref()?;
    let log: &LogReport = data.logs.get(judged.log)?;
    let drawn = data.joints.get(judged.joint);
    let picture = versus(&judged.time_s, &[("measured", &judged.measured), ("predicted", &judged.predicted)]);
    let rows = data.joints.iter().zip(&log.quality).map(|(joint, quality)| Row {
        name: &joint.name,
        unit: &joint.effort_unit,
        rms: quality.filtered.rms,
        percent: quality.filtered.relative_error_percent,
        r2: quality.filtered.r2,
        correlation: quality.filtered.correlation,
    });
    Some(FirstView {
        log: &log.name,
        unseen: judged.unseen,
        others: judged.others,
        rows: rows.collect(),
        percent: log.relative_error_filtered_percent,
        joint: drawn.map_or("", |joint| &joint.name),
        unit: drawn.map_or("", |joint| &joint.effort_unit),
        why: &judged.why,
        description: &judged.description,
        svg: picture.svg,
        across: picture.across,
        down: picture.down,
    })
}

/// Fails unless the log and the joint are there and the curves have one value per time.
pub(super) fn check(data: &ReportData, judged: &Judged) -> Result<(), ReportError> {
    let among = |place: &str, index: usize, found: usize| match index < found {
        true => Ok(()),
        false => Err(ReportError::Length { place: place.to_owned(), expected: index + 1, found }),
    };
    among("first screen, logs", judged.log, data.logs.len())?;
    among("first screen, joints", judged.joint, data.joints.len())?;
    super::lengths::time("first screen", &judged.time_s)?;
    let samples = judged.time_s.len();
    super::lengths::length("first screen, measured effort", judged.measured.len(), samples)?;
    super::lengths::length("first screen, predicted effort", judged.predicted.len(), samples)
}
