//! The door: lengths and times.

use super::lengths::{length, per_joint, time};
use crate::data::{BaseParameter, LogReport, LogSeries, ParameterVerdict, ReportData, ShapeVerdict};
use crate::error::ReportError;

pub(super) fn check(data: &ReportData) -> Result<(), ReportError> {
    let joints = data.joints.len();
    counts(data)?;
    if let Some(judged) = &data.judged {
        super::first::check(data, judged)?;
    }
    if let Some(picture) = &data.picture {
        super::picture::check(picture)?;
    }
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

/// Fails unless every count is that of its list, so that no two places of a page can disagree.
fn counts(data: &ReportData) -> Result<(), ReportError> {
    let c = &data.counts;
    let standard = |verdict: ParameterVerdict| {
        data.standard_parameters.iter().filter(|p| p.verdict == Some(verdict)).count()
    };
    let seen = |p: &&BaseParameter| p.verdict == Some(ParameterVerdict::SeenInData);
    let shape_seen = data.shape_parameters.iter().filter(|p| p.verdict == ShapeVerdict::SeenInData).count();
    for (place, stated, found) in [
        ("base parameters", c.base, data.base_parameters.len()),
        ("base parameters seen in the data", c.base_seen, data.base_parameters.iter().filter(seen).count()),
        ("standard parameters", c.standard, data.standard_parameters.len()),
        ("standard parameters seen in the data", c.standard_seen, standard(ParameterVerdict::SeenInData)),
        (
            "standard parameters carried by the prior",
            c.standard_carried,
            standard(ParameterVerdict::CarriedByPrior),
        ),
        (
            "standard parameters that are not identifiable",
            c.standard_not_identifiable,
            standard(ParameterVerdict::NotIdentifiable),
        ),
        ("standard parameters that are given", c.standard_given, standard(ParameterVerdict::Given)),
        ("shape parameters", c.shape, data.shape_parameters.len()),
        ("shape parameters seen in the data", c.shape_seen, shape_seen),
    ] {
        let found = found as u64;
        if stated != found {
            return Err(ReportError::Count { place: place.to_owned(), stated, found });
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
        if let Some(drawn) = &efforts.drawn {
            length(&place("effort to draw"), drawn.len(), samples)?;
        }
        if let Some(used) = &efforts.used {
            length(&place("used"), used.len(), samples)?;
        }
    }
    Ok(())
}
