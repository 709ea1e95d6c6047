//! Motions of the platform, and rows B4 and B12: the trajectory of identification.

use std::f64::consts::TAU;

use dynid::estimators::load_friction::{Prediction, Problem, Settings as Law};
use dynid::excitation::{information, limit_points};
use dynid::motion::signal::rms;
use dynid::motion::trajectory::{self, Form, FourierTrajectory, Quintic, RowOrder, Sampled};
use serde_json::json;

use super::machine::{Machine, Plane, SLIDERS};
use super::settings::{Circle, Settings};
use super::{fault, problem, reference, worst};
use crate::{Row, StudyError};

/// Samples of the period on which limits are checked.
const FINE: usize = 4000;
/// Samples on which the reference's optimiser kept its limits, and how nearly; its coefficients are rounded.
const GRID: usize = 40;
const GRID_TOLERANCE: f64 = 1e-3;
/// Slider speed below which friction has no sign, m/s.
pub(super) const REST: f64 = 1e-6;

fn sampled(trajectory: &FourierTrajectory, samples: usize) -> Sampled {
    let time = (0..samples).map(|k| trajectory.period() * k as f64 / samples as f64).collect();
    Sampled::at_times(trajectory, time)
}

/// The reference trajectory.
pub(super) fn identification(settings: &Settings) -> Result<FourierTrajectory, StudyError> {
    let own = &settings.trajectory;
    FourierTrajectory::from_rows(
        TAU / own.period,
        Form::VelocityAmplitudes,
        &RowOrder::default(),
        &own.rows,
        1,
    )
    .map_err(StudyError::from)
}

/// One period of it.
pub(super) fn identification_motion(settings: &Settings, samples: usize) -> Result<Sampled, StudyError> {
    Ok(sampled(&identification(settings)?, samples))
}

/// A trajectory of plain amplitudes.
pub(super) fn designed_motion(
    settings: &Settings,
    rows: &[Vec<f64>],
    samples: usize,
) -> Result<Sampled, StudyError> {
    let base = TAU / settings.trajectory.period;
    let trajectory = FourierTrajectory::from_rows(base, Form::Plain, &RowOrder::default(), rows, 1)?;
    Ok(sampled(&trajectory, samples))
}

/// A full circle from rest to rest, the angle held.
pub(super) fn circle(circle: &Circle, samples: usize) -> Result<Sampled, StudyError> {
    let turn = Quintic::new(0.0, TAU, circle.duration)?;
    let path = trajectory::Circle::new(circle.centre, circle.radius, turn)?;
    let time = (0..samples).map(|k| circle.duration * k as f64 / samples as f64).collect();
    let mut out = Sampled::at_times(&path, time);
    out.q.resize(3 * samples, circle.angle);
    out.dq.resize(3 * samples, 0.0);
    out.ddq.resize(3 * samples, 0.0);
    Ok(out)
}

/// Forces with the true parameters and the Stribeck law, in parts.
pub(super) fn true_forces(
    machine: &Machine,
    settings: &Settings,
    motion: &Sampled,
    plane: Plane,
) -> Result<Prediction, StudyError> {
    let record = machine.record(motion, plane)?;
    let zero = vec![vec![0.0; motion.samples()]; SLIDERS];
    let law = Law { rest_speed: REST, ..Law::default() };
    Problem::new(record, &zero, law).and_then(|p| p.predict(&settings.truth())).map_err(fault)
}

fn extremes(values: &[f64]) -> [f64; 3] {
    values.iter().fold([f64::INFINITY, f64::NEG_INFINITY, 0.0], |[low, high, size], x| {
        [low.min(*x), high.max(*x), size.max(x.abs())]
    })
}

/// Row B4.
pub(super) fn row(machine: &Machine, settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::trajectory()?;
    let samples = reference.n_samples;
    let motion = identification_motion(settings, samples)?;
    let joints = machine.joints(&motion);
    let forces = true_forces(machine, settings, &motion, Plane::Horizontal)?;
    let (mut within, mut off) = (true, 0.0_f64);
    let mut take = |found: f64, expected: f64| {
        let difference = (found - expected).abs();
        within &= difference <= reference.tolerance.abs + reference.tolerance.rel * expected.abs();
        off = worst(off, difference);
    };
    for state in &reference.samples {
        let s = (state.t / settings.trajectory.period * samples as f64).round() as usize;
        for (k, rate) in machine.driven().iter().enumerate() {
            take(motion.q[k * samples + s], state.pose[k]);
            take(joints.q[rate * samples + s], state.sliders[k]);
            take(joints.dq[rate * samples + s], state.slider_v[k]);
            if forces.drives[k].moving[s] {
                take(forces.drives[k].effort[s], state.tau[k]);
            }
        }
    }
    for (k, rate) in machine.driven().iter().enumerate() {
        let of = |values: &[f64]| extremes(&values[rate * samples..][..samples]);
        let [low, high, _] = of(&joints.q);
        take(low, reference.slider_min[k]);
        take(high, reference.slider_max[k]);
        take(of(&joints.dq)[2], reference.abs_slider_speed_max[k]);
        take(of(&joints.ddq)[2], reference.abs_slider_acc_max[k]);
        let drive = &forces.drives[k];
        take(rms(&drive.frictionless), reference.tau_frictionless_rms[k]);
        // At rest, in the first sample, the reference takes friction by the sign of rounding.
        let mut effort = drive.effort.clone();
        if let (Some(first), Some(own)) = (reference.samples.first(), effort.first_mut()) {
            *own = first.tau[k];
        }
        take(rms(&effort), reference.tau_full_rms[k]);
        take(extremes(&drive.effort)[2], reference.tau_full_absmax[k]);
        take(extremes(&drive.normal)[2], reference.abs_normal_z_max[k]);
    }

    let trajectory = identification(settings)?;
    let mut boundary = 0.0_f64;
    for series in trajectory.series() {
        for t in [0.0, settings.trajectory.period] {
            let at = series.at(t);
            boundary = boundary.max(at.velocity.abs()).max(at.acceleration.abs());
        }
    }
    let problem = problem::problem(machine, settings, settings.limits.angle)?;
    let rows = trajectory.to_rows(Form::Plain, &RowOrder::default())?;
    let broken = limit_points(&problem, &rows, GRID, GRID_TOLERANCE);
    let between = limit_points(&problem, &rows, FINE, 0.0);
    let fine = identification_motion(settings, FINE)?;
    let angle = extremes(&fine.q[2 * FINE..])[2];
    let triangle = information(&problem, &rows, samples);
    // Reference values count every sample of theirs.
    let factor = (samples as f64 / problem.effective_samples).sqrt();
    let values = triangle.svd().ok_or_else(|| fault("the singular values do not converge"))?;
    for (k, expected) in reference.base_singular_values.iter().enumerate() {
        take(factor * values.values[k], *expected);
    }
    let over: Vec<String> =
        between.iter().map(|p| format!("{} of {} by {:.1e}", p.kind, p.subject, p.excess)).collect();
    Ok(Row::new(
        "B4",
        "The reference trajectory: motion of platform and sliders, forces, singular values of the nine base columns; from rest to \
         rest within all limits",
        "reference numbers to 1e-6; speed and acceleration at both ends zero (1e-12); on the 40 samples of its own optimiser all \
         limits of sliders and legs to 1e-3; angle within 0.36 rad at all times",
        json!({ "difference": off, "boundary": boundary, "limits_broken": broken.len(), "largest_angle": angle,
                "broken_between_samples": between.iter()
                    .map(|p| json!({ "what": p.subject, "excess": p.excess })).collect::<Vec<_>>() }),
        format!(
            "{off:.1e}; {boundary:.1e}; {} limits broken; angle {angle:.4} rad; between samples, in units of the limits: {}",
            broken.len(),
            if over.is_empty() { "none broken".to_owned() } else { over.join(", ") },
        ),
        within && boundary <= 1e-12 && broken.is_empty() && angle <= settings.limits.angle_between,
    ))
}

/// Root mean squares of a slider's force along the trajectory, N.
#[derive(Debug, Clone, Copy)]
pub(super) struct Share {
    pub(super) total: f64,
    pub(super) friction: f64,
    pub(super) frictionless: f64,
    /// Largest force on the guideway in the plane, and the weight on it.
    pub(super) normal: [f64; 2],
}

/// What friction is of the forces along the trajectory.
pub(super) fn shares(forces: &Prediction) -> Vec<Share> {
    let of = |d: &dynid::estimators::load_friction::DrivePrediction| Share {
        total: rms(&d.effort),
        friction: rms(&d.friction),
        frictionless: rms(&d.frictionless),
        normal: [extremes(&d.normal)[2], d.constant_normal],
    };
    forces.drives.iter().map(of).collect()
}

/// Row B12.
pub(super) fn friction_row(shares: &[Share]) -> Row {
    let ratios: Vec<f64> = shares.iter().map(|s| s.friction / s.total).collect();
    let words: Vec<String> = ratios.iter().map(|r| format!("{:.0} %", 100.0 * r)).collect();
    Row::new(
        "B12",
        "Friction is a significant part of the forces of all sliders",
        "root mean square above half of the total force's on every slider",
        json!({ "shares": ratios, "friction_rms": shares.iter().map(|s| s.friction).collect::<Vec<_>>() }),
        words.join(", "),
        ratios.iter().all(|r| *r > 0.5),
    )
}
