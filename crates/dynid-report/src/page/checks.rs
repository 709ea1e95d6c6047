//! The door: lengths and times.

use crate::data::{LogReport, LogSeries, ReportData};
use crate::error::ReportError;

pub(super) fn check(data: &ReportData) -> Result<(), ReportError> {
    let joints = data.joints.len();
    per_joint("delays", data.delays.len(), joints)?;
    per_joint("held-out errors", data.held_out.joints.len(), joints)?;
    if let Some(precision) = &data.precision {
        per_joint("variance inflation", precision.variance_inflation_per_joint.len(), joints)?;
        for log in &precision.whiteness {
            per_joint(&format!("log {:?}, whiteness", log.log), log.joints.len(), joints)?;
        }
    }
    for log in &data.logs {
        per_joint(&format!("log {:?}, quality", log.name), log.quality.len(), joints)?;
        if let Some(series) = &log.series {
            length(&format!("log {:?}, series", log.name), series.joints.len(), joints)?;
            check_series(data, log, series)?;
        }
    }
    Ok(())
}

fn check_series(data: &ReportData, log: &LogReport, series: &LogSeries) -> Result<(), ReportError> {
    time(&format!("log {:?}", log.name), &series.time_s)?;
    let samples = series.time_s.len();
    for (joint, efforts) in data.joints.iter().zip(&series.joints) {
        let place = |what: &str| format!("log {:?}, joint {:?}, {what}", log.name, joint.name);
        length(&place("measured effort"), efforts.measured.len(), samples)?;
        if let Some(predicted) = &efforts.predicted {
            length(&place("predicted effort"), predicted.len(), samples)?;
        }
        if let Some(used) = &efforts.used {
            length(&place("used"), used.len(), samples)?;
        }
    }
    Ok(())
}

/// Fails unless every time is finite and none is below the one before.
pub(super) fn time(place: &str, time_s: &[f64]) -> Result<(), ReportError> {
    let mut least = f64::NEG_INFINITY;
    for (sample, &found) in time_s.iter().enumerate() {
        if !found.is_finite() || found < least {
            return Err(ReportError::Time { place: place.to_owned(), sample, least, found });
        }
        least = found;
    }
    Ok(())
}

pub(super) fn per_joint(place: &str, found: usize, joints: usize) -> Result<(), ReportError> {
    if found == 0 { Ok(()) } else { length(place, found, joints) }
}

pub(super) fn length(place: &str, found: usize, expected: usize) -> Result<(), ReportError> {
    if found == expected {
        return Ok(());
    }
    Err(ReportError::Length { place: place.to_owned(), expected, found })
}
