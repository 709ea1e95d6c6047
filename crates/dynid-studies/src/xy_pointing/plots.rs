//! Figures of the simulation and of what is identified from it.

use std::borrow::Borrow;

use dynid::estimators::search::SearchResult;
use dynid::report::{Chart, ChartCurve, CurveStyle};

use super::JOINTS;
use super::data::{Data, Knowledge};
use super::parameters::{PARAMETERS, Parameters};
use super::search::{Pair, Searches};
use super::simulation::Closeup;
use super::sweep::{Sweeps, Variant};
use crate::page::{self, axis, curve, logarithmic};
use crate::statistics::median;

/// Points of a curve over a whole period.
const POINTS: usize = 1571;

fn over(time: &[f64], signal: impl IntoIterator<Item = impl Borrow<f64>>) -> Vec<[f64; 2]> {
    page::over(time, signal.into_iter().take(POINTS))
}

/// Median over seeds of the best objective after so many evaluations.
fn median_history(results: &[SearchResult]) -> Vec<[f64; 2]> {
    let last = results.iter().map(|r| r.evaluations).max().unwrap_or(0);
    let at = |k: u64| {
        let evaluations = last * k / 200;
        let value = |r: &SearchResult| {
            let known = r.history.partition_point(|p| p.evaluations <= evaluations);
            known.checked_sub(1).map_or(f64::NAN, |k| r.history[k].value)
        };
        [evaluations as f64, median(results.iter().map(value).collect())]
    };
    (1..=200).map(at).collect()
}

/// How the paper's search converges.
pub(super) fn convergence(searches: &Searches) -> Chart {
    let of = |name: &str, results: &[SearchResult], style| curve(name, median_history(results), style);
    let (clean, noisy) = (&searches.clean, &searches.noisy);
    Chart {
        title: "Bee colony: best mean absolute error, median over seeds".into(),
        note: "The ideal model stays where friction leaves it, whatever the search does.".into(),
        x: axis("evaluations", ""),
        y: logarithmic("mean absolute error", "N m"),
        curves: vec![
            of("clearance model", &clean.clearance.results, CurveStyle::Line),
            of("clearance model, 1e-3 N m noise", &noisy.clearance.results, CurveStyle::Line),
            of("ideal model", &clean.ideal.results, CurveStyle::Line),
            of("ideal model, 1e-3 N m noise", &noisy.ideal.results, CurveStyle::Dashed),
        ],
        ..Chart::default()
    }
}

/// Torques of the search's first seed beside the noisy ones, and their errors.
pub(super) fn torques(data: &Data, searches: &Searches) -> Vec<Chart> {
    let time = data.counted(&data.record.time);
    let pair = &searches.noisy;
    let predicted = |knowledge, results: &[SearchResult]| {
        results.first().map_or_else(Vec::new, |r| data.predicted(knowledge, &r.point))
    };
    let models = [
        ("ideal model", predicted(Knowledge::Ideal, &pair.ideal.results)),
        ("clearance model", predicted(Knowledge::Clearance, &pair.clearance.results)),
    ];
    let mut charts = Vec::new();
    for joint in 0..JOINTS {
        let measured = data.joint(&searches.torque, joint);
        let mut curves = vec![curve("measured", over(time, measured), CurveStyle::Dots)];
        let mut errors = Vec::new();
        for (name, torque) in &models {
            let own = data.joint(torque, joint);
            curves.push(curve(name, over(time, own), CurveStyle::Line));
            let error = measured.iter().zip(own).map(|(m, p)| m - p);
            errors.push(curve(name, over(time, error), CurveStyle::Line));
        }
        for (title, label, curves) in [("torque", "torque", curves), ("error of the torque", "error", errors)]
        {
            charts.push(Chart {
                title: format!("Joint {}: {title}", joint + 1),
                x: axis("time", "s"),
                y: axis(label, "N m"),
                curves,
                ..Chart::default()
            });
        }
    }
    charts
}

/// Ratios of errors, a stem per parameter and a dot per seed.
pub(super) fn ratios(pair: &Pair, system: &Parameters, names: &str, title: &str) -> Chart {
    const FLOOR: f64 = 1e-3;
    let seeds = pair.clearance.results.len();
    let all: Vec<[f64; PARAMETERS]> = (0..seeds).map(|seed| pair.ratios(seed, system)).collect();
    let mut stems = Vec::new();
    let mut dots = Vec::new();
    for k in 0..PARAMETERS {
        let x = (k + 1) as f64;
        let middle = median(all.iter().map(|r| r[k]).collect());
        stems.extend([[x, 1.0], [x, middle.max(FLOOR)], [f64::NAN; 2]]);
        dots.extend(all.iter().map(|r| [x, r[k].max(FLOOR)]));
    }
    Chart {
        title: title.into(),
        note: format!(
            "Below 1 the clearance model is closer. Bars end at the median over seeds. In order: {names}."
        ),
        x: axis("parameter", ""),
        y: logarithmic("ratio of errors", ""),
        curves: vec![
            curve("equal", vec![[0.5, 1.0], [PARAMETERS as f64 + 0.5, 1.0]], CurveStyle::Dashed),
            curve("median", stems, CurveStyle::Line),
            curve("every seed", dots, CurveStyle::Dots),
        ],
        ..Chart::default()
    }
}

fn joints(of: impl Fn(usize) -> ChartCurve) -> Vec<ChartCurve> {
    (0..JOINTS).map(of).collect()
}

fn joint_name(joint: usize) -> String {
    format!("joint {}", joint + 1)
}

/// Journals in their bearings, and what happens when they land.
pub(super) fn journals(data: &Data, landing: &Closeup, swing: &Closeup, clearance: f64) -> Vec<Chart> {
    let circle = (0..=200).map(|k| {
        let (s, c) = (f64::from(k) * std::f64::consts::TAU / 200.0).sin_cos();
        [1e6 * clearance * c, 1e6 * clearance * s]
    });
    let path = |offset: &[[f64; 2]]| offset.iter().map(|e| e.map(|x| 1e6 * x)).collect();
    let whole = |joint: usize| {
        let journal = &data.record.journals[joint];
        let offsets = [&landing.record.journals[joint].offset[..], &journal.offset[1..]].concat();
        curve(&joint_name(joint), path(&offsets), CurveStyle::Line)
    };
    let mut orbit = joints(whole);
    orbit.insert(0, curve("clearance", circle.collect(), CurveStyle::Dashed));
    let early = &landing.record;
    let milliseconds: Vec<f64> = early.time.iter().map(|t| 1e3 * t).collect();
    let late = &swing.record;
    let first = late.time.len() - swing.samples;
    let swinging = joints(|joint| {
        let e = late.journals[joint].offset[first..].iter().map(|e| 1e6 * e[1]);
        curve(&joint_name(joint), over(&late.time[first..], e), CurveStyle::Line)
    });
    let sampled = |joint: usize| {
        let range = late.time[first]..=late.time[late.time.len() - 1];
        let at = data.record.time.iter().zip(&data.record.journals[joint].offset);
        at.filter(|(t, _)| range.contains(*t)).map(|(t, e)| [*t, 1e6 * e[1]]).collect::<Vec<_>>()
    };
    let mut ringing = swinging;
    ringing.push(curve("joint 1, samples of the data", sampled(0), CurveStyle::Dashed));
    let time = data.counted(&data.record.time);
    let friction =
        joints(|joint| curve(&joint_name(joint), over(time, &data.friction[joint]), CurveStyle::Line));
    let of_time = |title: &str, note: &str, unit: &str, y, curves| Chart {
        title: title.into(),
        note: note.into(),
        x: axis("time", unit),
        y,
        curves,
        ..Chart::default()
    };
    vec![
        Chart {
            title: "Journals in their bearings".into(),
            note: "In axes of the links, X up at angle zero, over the whole period. Both fall from the centre, land at the bottom and swing there."
                .into(),
            x: axis("e along X", "µm"),
            y: axis("e along Y", "µm"),
            equal_units: true,
            curves: orbit,
        },
        of_time(
            "Penetration while landing",
            "Negative before contact. The impact is over-damped: one rise, no bounce.",
            "ms",
            axis("penetration", "µm"),
            joints(|joint| {
                let depth = early.journals[joint].penetration.iter().map(|d| 1e6 * d);
                curve(&joint_name(joint), over(&milliseconds, depth), CurveStyle::Line)
            }),
        ),
        of_time(
            "Normal force while landing",
            "The damping of the asperities does not vanish with the penetration, so the force jumps.",
            "ms",
            axis("normal force", "N"),
            joints(|joint| {
                let force = early.journals[joint].normal_force.iter();
                curve(&joint_name(joint), over(&milliseconds, force), CurveStyle::Line)
            }),
        ),
        of_time(
            "Swing of the journals",
            "Close-up. At 100 Hz the samples alias it: models need the offsets at exactly these instants.",
            "s",
            axis("e along Y", "µm"),
            ringing,
        ),
        of_time(
            "Friction torque",
            "Signs follow the speeds; the rest follows the load.",
            "s",
            axis("friction torque", "N m"),
            friction,
        ),
        of_time(
            "Normal force",
            "",
            "s",
            axis("normal force", "N"),
            joints(|joint| {
                let force = data.counted(&data.record.journals[joint].normal_force).iter();
                curve(&joint_name(joint), over(time, force), CurveStyle::Line)
            }),
        ),
    ]
}

/// What the size of the clearance does.
pub(super) fn sweeps(sweeps: &Sweeps) -> Vec<Chart> {
    let of = |f: &dyn Fn(&Variant) -> f64| -> Vec<[f64; 2]> {
        sweeps.clearance.iter().map(|v| [1e6 * v.bearing.clearance, f(v)]).collect()
    };
    let chart = |title: &str, y, curves| Chart {
        title: title.into(),
        x: logarithmic("clearance", "µm"),
        y,
        curves,
        ..Chart::default()
    };
    let error = |name: &str, k: usize| curve(name, of(&|v| 100.0 * v.ideal[k]), CurveStyle::Line);
    let errors = vec![error("π7", 0), error("π8", 1)];
    let pendulum = |v: &Variant| sweeps.pendulum(v);
    vec![
        chart("Errors of the ideal model over the clearance", axis("relative error", "%"), errors),
        chart(
            "Swing of the journals over the clearance",
            logarithmic("frequency", "Hz"),
            vec![
                curve("pendulum as long as the clearance", of(&pendulum), CurveStyle::Dashed),
                curve("simulated", of(&|v| v.swing_hz), CurveStyle::Line),
            ],
        ),
    ]
}
