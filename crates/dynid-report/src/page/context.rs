//! What the templates see: the data without its long series, and the pictures made from them.

use minijinja::context;
use minijinja::value::{Serde, Value};
use serde::Serialize;

use super::chart::chart;
use super::first::first;
use super::picture::picture;
use super::pruning::pruning;
use super::script_data::script_json;
use super::study::section;
use super::trust::{limits_by_owner, trust};
use crate::data::{Fact, JointQuality, LogReport, LogRole, LogSeries, ReportData};
use crate::drawing::{autocorrelation_svg, histogram_svg};
use crate::error::ReportError;
use crate::number::{count, significant};
use crate::series::{PointBudget, log_payload, median_step, residual, summarise};

pub(super) fn context(data: &ReportData) -> Result<Value, ReportError> {
    let budget = PointBudget::share(&data.logs);
    let logs = data.logs.iter().map(|log| log_view(data, log, budget)).collect::<Result<Vec<_>, _>>()?;
    Ok(context! {
        title => data.title.as_str(),
        verdict => Serde(&data.verdict),
        cautions => Serde(&data.cautions),
        counts => Serde(&data.counts),
        first => Serde(first(data)),
        picture => Serde(data.picture.as_ref().map(picture).transpose()?.flatten()),
        robot => Serde(&data.robot),
        joints => Serde(&data.joints),
        any_elements => data.joints.iter().any(|joint| !joint.elements.is_empty()),
        logs => Serde(logs),
        estimation => Serde(&data.estimation),
        base_parameters => Serde(&data.base_parameters),
        trust => Serde(trust(data)),
        shape_parameters => Serde(&data.shape_parameters),
        friction_laws => Serde(data.friction_laws.iter().map(chart).collect::<Vec<_>>()),
        files => Serde(&data.files),
        friction_trials => Serde(&data.friction_trials),
        motions => Serde(&data.motions),
        consistency => Serde(&data.consistency),
        limits_by_owner => Serde(limits_by_owner(data.consistency.as_ref())),
        held_out => Serde(&data.held_out),
        precision => Serde(&data.precision),
        searches => Serde(data.searches.as_ref().map(section)),
        pruning => Serde(data.pruning.as_ref().map(pruning)),
        observation => Serde(&data.observation),
        unidentifiable => Serde(&data.unidentifiable),
        conditioning => Serde(&data.conditioning),
        ladders => Serde(&data.ladders),
        delays => Serde(&data.delays),
        provenance => Serde(&data.provenance),
    })
}

#[derive(Debug, Serialize)]
struct LogView<'a> {
    name: &'a str,
    role: LogRole,
    samples: Option<u64>,
    samples_used: Option<u64>,
    duration_s: Option<f64>,
    sample_rate_hz: Option<f64>,
    facts: &'a [Fact],
    quality: &'a [JointQuality],
    relative_error_raw_percent: Option<f64>,
    relative_error_filtered_percent: Option<f64>,
    plot: Option<PlotView<'a>>,
}

#[derive(Debug, Serialize)]
struct PlotView<'a> {
    description: &'a str,
    /// Samples behind each pair of drawn points.
    bucket: Option<usize>,
    /// JSON for the script element.
    json: String,
    predicted: bool,
    masked: bool,
    /// Samples not drawn because they are not finite, per joint.
    missing: Vec<usize>,
    residuals: Vec<Option<ResidualView>>,
}

/// Residual of one joint, ready to print.
#[derive(Debug, Serialize)]
struct ResidualView {
    mean: String,
    std: String,
    outside: String,
    first_autocorrelation: String,
    histogram: String,
    autocorrelation: Option<String>,
}

fn log_view<'a>(
    data: &'a ReportData,
    log: &'a LogReport,
    budget: PointBudget,
) -> Result<LogView<'a>, ReportError> {
    let drawn = log.series.as_ref().filter(|series| !series.time_s.is_empty() && !series.joints.is_empty());
    Ok(LogView {
        name: &log.name,
        role: log.role,
        samples: log.samples,
        samples_used: log.samples_used,
        duration_s: log.duration_s,
        sample_rate_hz: log.sample_rate_hz,
        facts: &log.facts,
        quality: &log.quality,
        relative_error_raw_percent: log.relative_error_raw_percent,
        relative_error_filtered_percent: log.relative_error_filtered_percent,
        plot: drawn.map(|series| plot_view(data, series, budget)).transpose()?,
    })
}

fn plot_view<'a>(
    data: &ReportData,
    series: &'a LogSeries,
    budget: PointBudget,
) -> Result<PlotView<'a>, ReportError> {
    let payload = log_payload(&data.joints, series, budget);
    let step_s = median_step(&series.time_s);
    Ok(PlotView {
        description: &series.description,
        bucket: payload.bucket,
        json: script_json(&payload)?,
        predicted: series.joints.iter().any(|joint| joint.predicted.is_some()),
        masked: series
            .joints
            .iter()
            .any(|joint| joint.used.as_ref().is_some_and(|used| used.contains(&false))),
        missing: series
            .joints
            .iter()
            .map(|joint| {
                let predicted = joint.predicted.as_deref().unwrap_or(&joint.measured);
                joint
                    .measured
                    .iter()
                    .zip(predicted)
                    .filter(|(m, p)| !(m.is_finite() && p.is_finite()))
                    .count()
            })
            .collect(),
        residuals: series
            .joints
            .iter()
            .map(|joint| residual_view(&residual(&joint.measured, joint.predicted.as_deref()?), step_s))
            .collect(),
    })
}

fn residual_view(residual: &[f64], step_s: f64) -> Option<ResidualView> {
    let summary = summarise(residual, step_s)?;
    let autocorrelation = summary.autocorrelation.as_ref();
    Some(ResidualView {
        mean: significant(summary.mean, 3),
        std: significant(summary.std, 3),
        outside: count(summary.histogram.outside as u64),
        first_autocorrelation: autocorrelation.map_or("-".to_owned(), |found| format!("{:.3}", found.first)),
        histogram: histogram_svg(&summary),
        autocorrelation: autocorrelation.map(|found| autocorrelation_svg(found, step_s)),
    })
}
