//! What the textbook route did with positions and efforts, in words.

use dynid_rows::conditioning::{PeriodicMotion, PreparedLog, Smoothing};
use serde_json::{Value, json};

use crate::input_record::short_name;
use crate::settings::{Settings, serde_name};

/// Name, value, unit, whether it was given, and reason.
pub(super) type Told = (String, Value, &'static str, bool, String);

/// Smoothing of positions and efforts on the textbook route.
pub(super) fn choices(settings: &Settings, logs: &[PreparedLog]) -> Vec<Told> {
    let (config, route) = (&settings.conditioning, settings.textbook_route());
    let effort = route.effort_smoothing.unwrap_or(route.smoothing);
    let mut out = Vec::new();
    if effort == Smoothing::Butterworth && route.smoothing == Smoothing::Butterworth {
        out.push((
            "filter cut-off".to_owned(),
            json!(route.cutoff_hz),
            "Hz",
            config.kernel_hz.is_some(),
            "textbook route: zero-phase Butterworth on positions and efforts".to_owned(),
        ));
        return out;
    }
    let mut smoothed = vec![("smoothing", config.smoothing, route.smoothing)];
    if effort != route.smoothing {
        smoothed.push(("smoothing of the effort", config.effort_smoothing, effort));
    }
    for (name, kind, smoothing) in smoothed {
        let word = kind.map_or_else(|| "butterworth".to_owned(), |kind| serde_name(&kind));
        for log in logs {
            let cutoff = smoothing.cutoff_hz(route.cutoff_hz, log);
            let reason = format!("textbook route: {}", in_words(smoothing, cutoff));
            let name = format!("{name} of {}", short_name(&log.name));
            out.push((name, json!(word), "", kind.is_some(), reason));
        }
    }
    out
}

fn in_words(smoothing: Smoothing, cutoff_hz: f64) -> String {
    let half = format!("half the amplitude at {cutoff_hz:.3} Hz");
    match smoothing {
        Smoothing::Butterworth => format!("zero-phase Butterworth at {cutoff_hz} Hz, central differences"),
        Smoothing::FivePoint { passes } => {
            format!("{passes} passes of least-squares cubics over five samples, central differences, {half}")
        }
        Smoothing::SavitzkyGolay(filter) => format!(
            "least-squares polynomials of degree {} over {} samples and their derivatives, {half}",
            filter.order(),
            filter.window()
        ),
        Smoothing::Frequency { harmonics } => {
            let last = harmonics.map_or_else(String::new, |last| format!("harmonic {last}, "));
            format!("Fourier series of whole periods up to {last}{cutoff_hz:.3} Hz and its derivatives")
        }
    }
}

/// What a stated period served for.
pub(super) fn period(settings: &Settings, motion: &PeriodicMotion) -> String {
    match settings.textbook_route().smoothing {
        Smoothing::Butterworth => format!(
            "states from Fourier series over {} periods, harmonics per joint {:?}; the stated period is corrected by the positions",
            motion.periods, motion.harmonics
        ),
        _ => format!(
            "whole periods count, {} of them; the stated period is corrected by the positions unless they were averaged",
            motion.periods
        ),
    }
}

/// What was averaged of a log, and the scatter between its periods.
pub(super) fn averaged(log: &PreparedLog) -> Option<Told> {
    let means = log.averaged.as_ref()?;
    let list = |deviations: &[f64]| {
        let words: Vec<String> = deviations.iter().map(|d| format!("{d:.2e}")).collect();
        words.join(" ")
    };
    let reason = format!(
        "the log is the mean of its whole periods; standard deviation between periods per joint: positions {}, efforts {}; the mean has 1/{:.2} of it",
        list(&means.position_deviation),
        list(&means.effort_deviation),
        (means.periods as f64).sqrt()
    );
    Some((format!("periods averaged of {}", short_name(&log.name)), json!(means.periods), "", true, reason))
}
