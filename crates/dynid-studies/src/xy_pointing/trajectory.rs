//! Row 3: the printed trajectory.

use dynid::excitation::criterion::{Criterion, Measure};
use dynid::excitation::limit_points;
use dynid::model::MotionBlock;
use dynid::motion::trajectory::{Form, FourierTrajectory, Point, RowOrder, Sampled};
use serde_json::json;

use super::pointing::Pointing;
use super::problem::{FINE, conditions, problem};
use super::settings::Settings;
use super::{JOINTS, reference};
use crate::{Row, StudyError};

/// An angular frequency at which joint 2 is too fast, rad/s.
const TOO_FAST: f64 = 0.41;
/// How nearly the printed coefficients, rounded to three decimals, start at rest at zero: rad, rad/s, rad/s².
const START: [f64; 3] = [2e-3, 2e-3, 5e-3];

pub(super) fn trajectory(base: f64, rows: &[Vec<f64>]) -> Result<FourierTrajectory, StudyError> {
    FourierTrajectory::from_rows(base, Form::Plain, &RowOrder::default(), rows, 1).map_err(StudyError::from)
}

/// Exact motion of one period.
#[derive(Debug)]
pub(super) struct Motion {
    pub(super) sampled: Sampled,
}

impl Motion {
    pub(super) fn of(settings: &Settings, rows: &[Vec<f64>], samples: usize) -> Result<Self, StudyError> {
        let trajectory = trajectory(settings.base_frequency, rows)?;
        let time = (0..samples).map(|k| trajectory.period() * k as f64 / samples as f64).collect();
        Ok(Motion { sampled: Sampled::at_times(&trajectory, time) })
    }

    pub(super) fn block(&self) -> MotionBlock<'_> {
        let s = &self.sampled;
        MotionBlock::plain(s.samples(), &s.q, &s.dq, &s.ddq)
    }
}

/// Least and greatest position, greatest speed and acceleration of every joint.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extent {
    pub(super) position: [f64; 2],
    pub(super) speed: f64,
    pub(super) acceleration: f64,
}

pub(super) fn extents(base: f64, rows: &[Vec<f64>]) -> Result<Vec<Extent>, StudyError> {
    let size = |e: dynid::motion::trajectory::Extremes| e.low.value.abs().max(e.high.value.abs());
    let trajectory = trajectory(base, rows)?;
    let of = |series: &dynid::motion::trajectory::Fourier| {
        let position = series.extremes();
        let velocity = series.derivative();
        Extent {
            position: [position.low.value, position.high.value],
            speed: size(velocity.extremes()),
            acceleration: size(velocity.derivative().extremes()),
        }
    };
    Ok(trajectory.series().iter().map(of).collect())
}

/// From least to greatest position of every joint, rad.
pub(super) fn travel(settings: &Settings, rows: &[Vec<f64>]) -> Result<Vec<f64>, StudyError> {
    let extents = extents(settings.base_frequency, rows)?;
    Ok(extents.iter().map(|e| e.position[1] - e.position[0]).collect())
}

/// Largest angular frequency at which a trajectory keeps the limits of speed and acceleration, rad/s.
fn fastest(pointing: &Pointing, settings: &Settings, rows: &[Vec<f64>]) -> Result<f64, StudyError> {
    let slow = extents(1.0, rows)?;
    let bodies = pointing.mechanism().bodies();
    let of = |((body, extent), most): ((&dynid::model::Body, &Extent), &f64)| {
        let speed = body.joint.limits.velocity.unwrap_or(f64::INFINITY) / extent.speed;
        speed.min((most / extent.acceleration).sqrt())
    };
    Ok(bodies.iter().zip(&slow).zip(&settings.acceleration).map(of).fold(f64::INFINITY, f64::min))
}

/// Position, velocity and acceleration at the start of a period, the largest over joints.
pub(super) fn at_start(base: f64, rows: &[Vec<f64>]) -> Result<[f64; 3], StudyError> {
    let points: Vec<Point> = trajectory(base, rows)?.series().iter().map(|s| s.at(0.0)).collect();
    let largest = |of: fn(&Point) -> f64| points.iter().map(|p| of(p).abs()).fold(0.0, f64::max);
    Ok([largest(|p| p.position), largest(|p| p.velocity), largest(|p| p.acceleration)])
}

pub(super) fn row(pointing: &Pointing, settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::trajectory()?;
    let rows = &settings.trajectory;
    let printed = trajectory(settings.base_frequency, rows)?;
    let mut value = 0.0_f64;
    for sample in &reference.samples {
        for (j, series) in printed.series().iter().enumerate() {
            let own = series.at(sample.t);
            for (own, wanted) in
                [(own.position, sample.q[j]), (own.velocity, sample.qd[j]), (own.acceleration, sample.qdd[j])]
            {
                value = value.max((own - wanted).abs());
            }
        }
    }
    let mut extreme = 0.0_f64;
    for (j, own) in extents(settings.base_frequency, rows)?.iter().enumerate().take(JOINTS) {
        for (own, wanted) in [
            (own.position[0], reference.q_min[j]),
            (own.position[1], reference.q_max[j]),
            (own.speed, reference.abs_qd_max[j]),
            (own.acceleration, reference.abs_qdd_max[j]),
        ] {
            extreme = extreme.max((own - wanted).abs());
        }
    }
    let fastest = fastest(pointing, settings, rows)?;
    extreme = extreme.max((fastest - reference.omega_f_max_allowed).abs());
    let start = at_start(settings.base_frequency, rows)?;

    let raw = Criterion::raw(Measure::Condition);
    let problem_at = |base: f64| problem(pointing, settings, base, raw.clone());
    let slow = problem_at(settings.base_frequency)?;
    let kept = limit_points(&slow, rows, FINE, 0.0);
    let broken: Vec<String> = limit_points(&problem_at(TOO_FAST)?, rows, FINE, 0.0)
        .iter()
        .map(|p| format!("{} of {}", p.kind, p.subject))
        .collect();
    let found = conditions(&slow, rows, settings.samples);
    let wanted = [reference.cond_base_200_samples, reference.cond_base_column_normalised];
    let condition = found.iter().zip(wanted).map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max);
    let starts = start.iter().zip(START).all(|(x, most)| *x <= most);
    Ok(Row::new(
        "3",
        "Table 1 evaluated as the reference does; within all limits at 0.4 rad/s, too fast for joint 2 at 0.41; it starts at rest \
         at zero to the rounding of its coefficients",
        "values 1e-9, extremes and largest angular frequency 1e-6, condition of the 8 columns 1e-6 relative; start 2e-3 rad, \
         2e-3 rad/s, 5e-3 rad/s²",
        json!({
            "value": value,
            "extreme": extreme,
            "condition_relative": condition,
            "condition_raw": found[0],
            "condition_unit_norm": found[1],
            "limits_broken": kept.len(),
            "limits_broken_at_0.41": broken,
            "largest_frequency": fastest,
            "start": start,
        }),
        format!(
            "{value:.1e}, {extreme:.1e}, {condition:.1e}: condition {:.1} raw, {:.3} with unit columns; {} limits broken at {}, \
             at {TOO_FAST} the {}; at most {fastest:.5} rad/s; start {:.1e} rad, {:.1e} rad/s, {:.1e} rad/s²",
            found[0],
            found[1],
            kept.len(),
            settings.base_frequency,
            broken.join(", "),
            start[0],
            start[1],
            start[2],
        ),
        value <= 1e-9
            && extreme <= 1e-6
            && condition <= 1e-6
            && kept.is_empty()
            && broken == ["velocity of j2"]
            && starts,
    ))
}
