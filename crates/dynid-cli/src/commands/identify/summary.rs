//! What an identification comes to, for people.

use std::fmt::Write;

use dynid::estimate::{Choice, Estimate, LogScale, ShapeValue, ShapeVerdict};
use serde_json::Value;

use crate::commands::table;

/// Settings, fits, checks and verdict.
pub(in crate::commands) fn summary(estimate: &Estimate) -> String {
    let mut out = String::from("settings:\n");
    for choice in &estimate.conditioning.choices {
        let _ = writeln!(out, "  {}", setting(choice));
    }
    let fit = &estimate.fit;
    let _ = writeln!(
        out,
        "\ntraining fit (filtered at {:.1} Hz, relative error {} %):",
        fit.filter_hz,
        table::number(fit.filtered.relative_error)
    );
    out += &table::agreement(&estimate.joints, &fit.raw, &fit.filtered, &fit.by_motion);
    for fit in &estimate.validation {
        let _ = writeln!(
            out,
            "\nvalidation on {} (filtered at {:.1} Hz, relative error {} %):",
            fit.log,
            fit.filter_hz,
            table::number(fit.filtered.relative_error)
        );
        out += &table::agreement(&estimate.joints, &fit.raw, &fit.filtered, &fit.by_motion);
    }
    out += "\nchecks:\n";
    for check in &estimate.verdict.checks {
        let value =
            check.value.map_or_else(String::new, |v| format!("{} {}", table::number(Some(v)), check.unit));
        let value = value.trim_end();
        let _ = writeln!(
            out,
            "  [{}] {}: {value} ({}): {}",
            check.status, check.name, check.limit, check.meaning
        );
    }
    out += &parameters(estimate);
    if let Some(searches) = &estimate.searches {
        let _ = writeln!(
            out,
            "\nsearches over {} unknowns on {} samples: least squares has {}",
            searches.unknowns.len(),
            searches.samples,
            table::number(Some(searches.least_squares))
        );
        for by in &searches.found {
            let evaluations: u64 = by.runs.iter().map(|r| r.evaluations).sum();
            let number = |x: f64| table::number(Some(x));
            let _ = writeln!(
                out,
                "  {}: {} (median {} of {}, {evaluations} evaluations, {} s)",
                by.algorithm,
                number(by.value),
                number(by.median),
                by.runs.len(),
                number(by.seconds)
            );
        }
    }
    if !estimate.verdict.cautions.is_empty() {
        out += "\nwhat mends it, the worst first (`dynid explain NAME` says more):\n";
        for caution in &estimate.verdict.cautions {
            let _ = writeln!(out, "  [{}] {}: {}", caution.status, caution.name, caution.remedy);
        }
    }
    let _ = writeln!(out, "\n{}: {}", estimate.verdict.status, estimate.verdict.headline);
    out
}

/// A choice of the conditioning, where it comes from and why.
fn setting(choice: &Choice) -> String {
    let value = match &choice.value {
        Value::Null => return format!("{} = none ({}: {})", choice.name, choice.origin, choice.reason),
        Value::Number(n) => table::number(n.as_f64()),
        Value::Array(list) if list.is_empty() => "none".to_owned(),
        Value::Array(list) => {
            let word = |x: &Value| x.as_str().map_or_else(|| table::number(x.as_f64()), str::to_owned);
            list.iter().map(word).collect::<Vec<_>>().join(" ")
        }
        Value::String(text) => text.clone(),
        other => other.to_string(),
    };
    format!("{} = {value} {} ({}: {})", choice.name, choice.unit, choice.origin, choice.reason)
}

/// How many parameters are seen, those that a table does not hold, and what would help.
fn parameters(estimate: &Estimate) -> String {
    let counted = estimate.counts.standard_in_words();
    let mut out = format!("\nparameters: {counted} (one by one in the report)\n");
    let shapes = estimate.shape_parameters.iter().map(shape_parameter);
    let scales = estimate.log_scales.iter().map(log_scale);
    for line in shapes.chain(scales).chain(estimate.motions_that_would_help.iter().cloned()) {
        let _ = writeln!(out, "  {line}");
    }
    out
}

/// A parameter that enters nonlinearly: value, interval, verdict with its reason.
fn shape_parameter(shape: &ShapeValue) -> String {
    let of = format!("{} = {} {}", shape.name, table::number(Some(shape.value)), shape.unit);
    judged(&of, shape.interval, shape.verdict, shape.reason.as_deref())
}

/// Friction of a log over that of the others.
fn log_scale(scale: &LogScale) -> String {
    let of =
        format!("friction in {} = {} of that in the others", scale.log, table::number(Some(scale.value)));
    judged(&of, scale.interval, scale.verdict, scale.reason.as_deref())
}

fn judged(of: &str, interval: Option<(f64, f64)>, verdict: ShapeVerdict, reason: Option<&str>) -> String {
    let number = |x: f64| table::number(Some(x));
    let interval = interval
        .map_or_else(String::new, |(low, high)| format!(" (95 %: {} to {})", number(low), number(high)));
    let reason = reason.map_or_else(String::new, |r| format!(", {r}"));
    format!("{of}{interval}: {verdict}{reason}")
}
