//! The paper's figures 7 to 16, redone.

use dynid::estimators::load_friction::Prediction;
use dynid::estimators::search::SearchResult;
use dynid::motion::trajectory::Sampled;
use dynid::report::{Chart, ChartAxis, ChartCurve, CurveStyle};

use super::encoders::Signals;
use super::fits::{self, Batch};
use super::machine::{Machine, SLIDERS};
use crate::StudyError;
use crate::page::{axis, curve, logarithmic, over};

/// Every few samples: dots of all of them would hide the lines.
fn dots(name: &str, time: &[f64], signal: &[f64]) -> ChartCurve {
    const STRIDE: usize = 4;
    let points = over(time, signal).into_iter().step_by(STRIDE).collect();
    curve(name, points, CurveStyle::Dots)
}

fn of_time(title: String, note: &str, y: ChartAxis, curves: Vec<ChartCurve>) -> Chart {
    Chart { title, note: note.into(), x: axis("time", "s"), y, curves, ..Chart::default() }
}

fn sliders(of: impl Fn(usize) -> ChartCurve) -> Vec<ChartCurve> {
    (0..SLIDERS).map(of).collect()
}

fn slider(k: usize) -> String {
    format!("slider {}", k + 1)
}

/// Figures 7 and 8: the platform and the sliders.
pub(super) fn motion(machine: &Machine, motion: &Sampled) -> Vec<Chart> {
    let samples = motion.samples();
    let joints = machine.joints(motion);
    let platform = |k: usize| over(&motion.time, &motion.q[k * samples..][..samples]);
    let position = |k: usize| {
        let rate = machine.driven()[k];
        curve(&slider(k), over(&motion.time, &joints.q[rate * samples..][..samples]), CurveStyle::Line)
    };
    vec![
        of_time(
            "Platform: position".into(),
            "Figure 7a of the paper.",
            axis("position", "m"),
            vec![curve("x", platform(0), CurveStyle::Line), curve("y", platform(1), CurveStyle::Line)],
        ),
        of_time(
            "Platform: angle".into(),
            "Figure 7b.",
            axis("angle", "rad"),
            vec![curve("angle", platform(2), CurveStyle::Line)],
        ),
        of_time("Sliders: position".into(), "Figure 8.", axis("position", "m"), sliders(position)),
    ]
}

/// Figures 9 and 10: speeds and accelerations from encoders.
pub(super) fn encoders(time: &[f64], signals: &[Signals]) -> Vec<Chart> {
    let chart = |derivative: usize| {
        let (what, unit, note) = [
            ("speed", "m/s", "Figure 9. Filtered, and of one slider differences of the encoder as they are."),
            ("acceleration", "m/s²", "Figure 10. Likewise; the encoder has steps of 1 µm."),
        ][derivative];
        let mut curves = Vec::new();
        for (k, own) in signals.iter().enumerate().take(1) {
            curves.push(dots(&format!("{}, raw", slider(k)), time, &own.raw[derivative]));
        }
        for (k, own) in signals.iter().enumerate() {
            curves.push(curve(&slider(k), over(time, &own.filtered[derivative]), CurveStyle::Line));
        }
        of_time(format!("Sliders: {what}"), note, axis(what, unit), curves)
    };
    (0..2).map(chart).collect()
}

/// Figures 11 and 12: measured forces with two fits, and their residuals.
pub(super) fn fits(time: &[f64], batch: &Batch) -> Result<Vec<Chart>, StudyError> {
    let predicted = batch
        .fits
        .iter()
        .map(|f| f.problem.predict(&f.fit.theta).map_err(super::fault))
        .collect::<Result<Vec<Prediction>, _>>()?;
    let mut charts = Vec::new();
    for k in 0..SLIDERS {
        let measured = &batch.efforts[k];
        let mut curves = vec![dots("measured", time, measured)];
        for (fit, own) in batch.fits.iter().zip(&predicted).take(2) {
            curves.push(curve(fits::name(fit.model), over(time, &own.drives[k].effort), CurveStyle::Line));
        }
        let note = "Figures 11 and 12: noise of 2 N, least squares.";
        charts.push(of_time(format!("Slider {}: force", k + 1), note, axis("force", "N"), curves));
    }
    Ok(charts)
}

/// What laws of friction leave over without noise.
pub(super) fn residuals(time: &[f64], clean: &Batch) -> Result<Vec<Chart>, StudyError> {
    let mut charts = Vec::new();
    for k in 0..SLIDERS {
        let mut curves = Vec::new();
        for fit in clean.fits.iter().rev() {
            let predicted = fit.problem.predict(&fit.fit.theta).map_err(super::fault)?;
            let own = &predicted.drives[k];
            let off = clean.efforts[k].iter().zip(&own.effort).zip(&own.moving);
            let off: Vec<f64> = off.map(|((m, p), moving)| if *moving { m - p } else { f64::NAN }).collect();
            curves.push(curve(fits::name(fit.model), over(time, &off), CurveStyle::Line));
        }
        let note = "Without noise: what the law itself cannot follow.";
        charts.push(of_time(format!("Slider {}: residual", k + 1), note, axis("residual", "N"), curves));
    }
    Ok(charts)
}

/// Figure 13: forces on the guideway, lying and upright.
pub(super) fn normal_forces(time: &[f64], lying: &Prediction, upright: &[Vec<f64>]) -> Vec<Chart> {
    let own = |k: usize| curve(&slider(k), over(time, &lying.drives[k].normal), CurveStyle::Line);
    let other = |k: usize| curve(&slider(k), over(time, &upright[k]), CurveStyle::Line);
    vec![
        of_time(
            "Forces on the guideway in the plane".into(),
            "Figure 13.",
            axis("normal force", "N"),
            sliders(own),
        ),
        of_time(
            "Forces on the guideway, plane upright".into(),
            "The same motion with gravity in the plane.",
            axis("normal force", "N"),
            sliders(other),
        ),
    ]
}

/// Figures 14 and 15: the circle, and forces predicted there.
pub(super) fn circle(motion: &Sampled, truth: &[Vec<f64>], batch: &Batch, on: &fits::OnCircle) -> Vec<Chart> {
    let samples = motion.samples();
    let path = (0..=samples).map(|s| [motion.q[s % samples], motion.q[samples + s % samples]]).collect();
    let mut charts = vec![Chart {
        title: "Circle of the platform".into(),
        note: "Figure 14.".into(),
        x: axis("x", "m"),
        y: axis("y", "m"),
        equal_units: true,
        curves: vec![curve("path", path, CurveStyle::Line)],
    }];
    let names: Vec<&str> = batch.fits.iter().map(|f| fits::name(f.model)).collect();
    for (k, truth) in truth.iter().enumerate() {
        let mut curves = vec![dots("true", &motion.time, truth)];
        curves.extend(
            names
                .iter()
                .zip(&on.predicted)
                .take(1)
                .map(|(n, p)| curve(n, over(&motion.time, &p.drives[k].effort), CurveStyle::Line)),
        );
        let note = "Figure 15: predicted with parameters from the other trajectory, 2 N of noise.";
        charts.push(of_time(
            format!("Slider {}: force on the circle", k + 1),
            note,
            axis("force", "N"),
            curves,
        ));
    }
    for (k, truth) in truth.iter().enumerate() {
        let mut curves = Vec::new();
        for (name, own) in names.iter().zip(&on.predicted).rev() {
            let own = &own.drives[k];
            let off = truth.iter().zip(&own.effort).zip(&own.moving);
            let off: Vec<f64> = off.map(|((t, p), moving)| if *moving { t - p } else { f64::NAN }).collect();
            curves.push(curve(name, over(&motion.time, &off), CurveStyle::Line));
        }
        charts.push(of_time(
            format!("Slider {}: error on the circle", k + 1),
            "",
            axis("error", "N"),
            curves,
        ));
    }
    charts
}

/// Figure 16: friction beside the whole force.
pub(super) fn friction(time: &[f64], forces: &Prediction) -> Vec<Chart> {
    let chart = |k: usize| {
        let own = &forces.drives[k];
        of_time(
            format!("Slider {}: friction", k + 1),
            "Figure 16.",
            axis("force", "N"),
            vec![
                curve("force", over(time, &own.effort), CurveStyle::Line),
                curve("friction", over(time, &own.friction), CurveStyle::Line),
            ],
        )
    };
    (0..SLIDERS).map(chart).collect()
}

/// How pattern searches come down to least squares.
pub(super) fn convergence(
    searches: &[(&str, &SearchResult)],
    least_squares: f64,
    iterations: usize,
) -> Chart {
    let last = searches.iter().map(|s| s.1.evaluations).max().unwrap_or(0) as f64;
    let mut curves: Vec<ChartCurve> = searches
        .iter()
        .map(|(name, s)| {
            let stride = (s.history.len() / 1000).max(1);
            let points = s.history.iter().step_by(stride).chain(s.history.last());
            let points = points.map(|p| [p.evaluations as f64, p.value / least_squares]).collect();
            curve(name, points, CurveStyle::Line)
        })
        .collect();
    curves.push(curve("least squares", vec![[1.0, 1.0], [last, 1.0]], CurveStyle::Dashed));
    Chart {
        title: "J of the best point".into(),
        note: format!(
            "Over that of least squares, which needs {iterations} iterations from all of its starts together."
        ),
        x: logarithmic("evaluations", ""),
        y: logarithmic("J over that of least squares", ""),
        curves,
        ..Chart::default()
    }
}
