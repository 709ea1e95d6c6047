//! The paper's figures, redone.

use dynid::model::Limits;
use dynid::report::{Chart, ChartCurve, CurveStyle};

use super::JOINTS;
use super::pointing::Pointing;
use super::settings::Settings;
use super::trajectory::Motion;
use crate::StudyError;
use crate::page::{axis, curve};

const SAMPLES: usize = 600;

/// Positions, velocities and accelerations of every joint along trajectories, with their limits.
pub(super) fn motion(
    pointing: &Pointing,
    settings: &Settings,
    trajectories: &[(&str, &[Vec<f64>])],
) -> Result<Vec<Chart>, StudyError> {
    let mut motions = Vec::new();
    for (name, rows) in trajectories {
        motions.push((*name, Motion::of(settings, rows, SAMPLES)?));
    }
    let period = std::f64::consts::TAU / settings.base_frequency;
    let bodies = pointing.mechanism().bodies();
    let chart = |(joint, derivative): (usize, usize)| {
        let (label, unit) =
            [("position", "rad"), ("velocity", "rad/s"), ("acceleration", "rad/s²")][derivative];
        let mut curves: Vec<ChartCurve> = motions
            .iter()
            .map(|(name, motion)| {
                let s = &motion.sampled;
                let signal = &[&s.q, &s.dq, &s.ddq][derivative][joint * SAMPLES..][..SAMPLES];
                let time = |k: usize| period * k as f64 / SAMPLES as f64;
                let points = signal.iter().enumerate().map(|(k, x)| [time(k), *x]).collect();
                curve(name, points, CurveStyle::Line)
            })
            .collect();
        if let Some((low, high)) =
            range(&bodies[joint].joint.limits, settings.acceleration[joint], derivative)
        {
            let across = |level: f64| [[0.0, level], [period, level]];
            let mut points = across(low).to_vec();
            points.push([f64::NAN; 2]);
            points.extend(across(high));
            curves.push(curve("limits", points, CurveStyle::Dashed));
        }
        Chart {
            title: format!("Joint {}: {label}", joint + 1),
            x: axis("time", "s"),
            y: axis(label, unit),
            curves,
            ..Chart::default()
        }
    };
    Ok((0..JOINTS).flat_map(|joint| (0..3).map(move |d| (joint, d))).map(chart).collect())
}

fn range(limits: &Limits, acceleration: f64, derivative: usize) -> Option<(f64, f64)> {
    let both = |most: f64| (-most, most);
    match derivative {
        0 => limits.position,
        1 => limits.velocity.map(both),
        _ => Some(both(acceleration)),
    }
}
