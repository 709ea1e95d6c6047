//! Searches over all parameters on the page.

use dynid_report as report;
use dynid_report::Value;

use crate::searches::{SearchedBy, Searches};
use crate::settings::{SearchLoss, SearchOver};

/// The section of the page.
pub(super) fn section(found: &Searches) -> report::StudySection {
    let over = match found.over {
        SearchOver::Base => "base parameters",
        SearchOver::Standard => "standard parameters",
    };
    let loss = match found.loss {
        SearchLoss::Absolute => "mean absolute residual",
        SearchLoss::Squared => "mean squared residual",
        SearchLoss::Huber => "Huber's loss",
    };
    let mut text = vec![format!(
        "{} unknowns ({over} and shape parameters) within bounds, moved all at once by searches that know nothing of their form, on {} samples of \
         filtered states. Loss: {loss}, joints added up by their weights. Least squares, which this page is about, has {} on the same samples; it \
         needs no bounds and no luck.",
        found.unknowns.len(),
        found.samples,
        number(found.least_squares)
    )];
    if !found.outside.is_empty() {
        text.push(format!(
            "The least-squares answer lies outside the bounds of {}: no search can get there.",
            found.outside.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
        ));
    }
    let row = |by: &SearchedBy| {
        let evaluations: u64 = by.runs.iter().map(|r| r.evaluations).sum();
        vec![
            Value::Text(by.algorithm.clone()),
            Value::Number(by.value),
            Value::Number(by.value / found.least_squares),
            Value::Number(by.median),
            Value::Number(by.runs.len() as f64),
            Value::Number(evaluations as f64),
            Value::Number(by.seconds),
        ]
    };
    let head =
        ["algorithm", "best loss", "over least squares", "median loss", "runs", "evaluations", "time, s"];
    let table = report::StudyTable {
        caption: "Losses".to_owned(),
        head: head.map(str::to_owned).to_vec(),
        rows: found.found.iter().map(row).collect(),
    };
    let of_unknown = |(k, name): (usize, &String)| {
        let values = found.found.iter().map(|by| Value::Number(by.point.get(k).copied().unwrap_or(f64::NAN)));
        let (low, high) = found.bounds[k];
        let own = [low, high, found.least_squares_point[k]].map(Value::Number);
        std::iter::once(Value::Text(name.clone())).chain(own).chain(values).collect()
    };
    let named = ["unknown", "lower", "upper", "least squares"].map(str::to_owned);
    let points = report::StudyTable {
        caption: "Best points".to_owned(),
        head: named.into_iter().chain(found.found.iter().map(|by| by.algorithm.clone())).collect(),
        rows: found.unknowns.iter().enumerate().map(of_unknown).collect(),
    };
    report::StudySection {
        title: "Searches over all parameters".to_owned(),
        text,
        tables: vec![table, points],
        charts: vec![convergence(found, loss)],
        ..report::StudySection::default()
    }
}

/// Best loss against evaluations, of the best run of each algorithm, and that of least squares.
fn convergence(found: &Searches, loss: &str) -> report::Chart {
    let last = found.found.iter().flat_map(|by| &by.runs).map(|r| r.evaluations).max().unwrap_or(1);
    let curve = |by: &SearchedBy| {
        let best = by.runs.iter().min_by(|a, b| a.value.total_cmp(&b.value));
        let points = best.into_iter().flat_map(|run| run.history.iter().map(|(n, v)| [*n as f64, *v]));
        report::ChartCurve {
            name: by.algorithm.clone(),
            points: points.collect(),
            ..report::ChartCurve::default()
        }
    };
    let first =
        found.found.iter().flat_map(|by| &by.runs).filter_map(|r| r.history.first()).map(|(n, _)| *n).min();
    let least = report::ChartCurve {
        name: "least squares".to_owned(),
        points: vec![[first.unwrap_or(1) as f64, found.least_squares], [last as f64, found.least_squares]],
        style: report::CurveStyle::Dashed,
    };
    let axis = |label: &str| report::ChartAxis {
        label: label.to_owned(),
        logarithmic: true,
        ..report::ChartAxis::default()
    };
    report::Chart {
        title: "Convergence".to_owned(),
        note: "Best run of each algorithm.".to_owned(),
        x: axis("evaluations"),
        y: axis(loss),
        curves: found.found.iter().map(curve).chain([least]).collect(),
        ..report::Chart::default()
    }
}

fn number(x: f64) -> String {
    if (1e-3..1e5).contains(&x) { format!("{x:.4}") } else { format!("{x:.4e}") }
}
