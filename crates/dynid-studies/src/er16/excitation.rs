//! Rows 4 and 5: the printed trajectory and one of our own.

use dynid::design::DesignError;
use dynid::excitation::constraint::{FramePoint, Region};
use dynid::excitation::{Outcome, Problem, Settings as SearchSettings, design, information, limit_points};
use dynid::model::{RobotModel, Vec3};
use dynid::motion::trajectory::{Form, Fourier, RowOrder};
use serde_json::json;

use super::arm::Arm;
use super::reference;
use super::settings::Settings;
use crate::excitation::{Excitation, conditions_of_starts};
use crate::{Row, RunSettings, StudyError};

/// Wrist centre in frame 3, m.
pub(super) const WRIST: [f64; 3] = [0.13, 0.65, 0.0];
/// Samples of the period on which limits are checked: twenty times as many as the search uses.
const FINE: usize = 2000;

/// A designed trajectory.
#[derive(Debug)]
pub(super) struct Designed {
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) condition: f64,
    /// Condition of every start that ended within the limits.
    pub(super) starts: Vec<f64>,
}

/// Which columns a trajectory is designed for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Columns {
    /// The 15 inertial ones.
    Inertial,
    /// With sign, velocity and one per joint: 24.
    WithLinearFriction,
}

pub(super) fn problem(arm: &Arm, settings: &Settings, columns: Columns) -> Result<Problem, StudyError> {
    let mechanism = &arm.mechanism;
    let model = match columns {
        Columns::Inertial => RobotModel::new(mechanism.clone(), Vec::new()),
        Columns::WithLinearFriction => arm.with_linear_friction(true),
    };
    let wrist = FramePoint { frame: mechanism.bodies()[2].name.clone(), position: Vec3(WRIST) };
    let floor = Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: settings.workspace.height };
    let axis = Region::OutsideCylinder { center: [0.0; 2], radius: settings.workspace.radius };
    let excitation = Excitation {
        mechanism,
        base: settings.base_frequency(),
        samples: FINE,
        acceleration: &settings.acceleration_deg.map(f64::to_radians),
        regions: &[(wrist.clone(), floor), (wrist, axis)],
        nominal: (arm.model.clone(), arm.shape.clone(), arm.linear.clone()),
    };
    excitation.problem(model)
}

fn condition(problem: &Problem, rows: &[Vec<f64>]) -> Option<f64> {
    problem.criterion.value(&information(problem, rows, FINE)).map(f64::exp)
}

/// Row 4: all readings of Appendix A.1 evaluated, and the limits that each breaks.
pub(super) fn printed_trajectory(arm: &Arm, settings: &Settings) -> Result<Row, StudyError> {
    let reference = reference::trajectory()?;
    let problem = problem(arm, settings, Columns::Inertial)?;
    let (mut angle, mut relative) = (0.0_f64, 0.0_f64);
    let mut violations = Vec::new();
    for case in &reference.appendix_evaluations {
        let order: RowOrder = case.order.parse()?;
        let series = reference
            .appendix_a1
            .iter()
            .map(|row| Fourier::from_row(settings.base_frequency(), Form::Plain, &order, row))
            .collect::<Result<Vec<Fourier>, _>>()?;
        for (j, series) in series.iter().enumerate() {
            // The reference takes extremes over its 2000 samples.
            let samples: Vec<[f64; 3]> = (0..FINE)
                .map(|k| {
                    let p = series.at(k as f64 * series.period() / FINE as f64);
                    [p.position, p.velocity, p.acceleration].map(f64::to_degrees)
                })
                .collect();
            let least = samples.iter().map(|s| s[0]).fold(f64::INFINITY, f64::min);
            let most = samples.iter().map(|s| s[0]).fold(f64::NEG_INFINITY, f64::max);
            let size = |k: usize| samples.iter().map(|s| s[k].abs()).fold(0.0, f64::max);
            for (own, wanted) in [
                (least, case.q_min_deg[j]),
                (most, case.q_max_deg[j]),
                (size(1), case.max_abs_qd_deg[j]),
                (size(2), case.max_abs_qdd_deg[j]),
            ] {
                angle = angle.max((own - wanted).abs());
            }
        }
        let rows: Vec<Vec<f64>> =
            series.iter().map(|s| s.to_row(Form::Plain, &RowOrder::default())).collect::<Result<_, _>>()?;
        let found = condition(&problem, &rows).unwrap_or(f64::INFINITY);
        relative = relative.max((found / case.cond_phi15 - 1.0).abs());
        let worst = limit_points(&problem, &rows, FINE, 0.0);
        violations.push(json!({
            "order": case.order,
            "condition": found,
            "limits_broken": worst.len(),
            "worst_excess": worst.first().map(|p| p.excess),
        }));
    }
    let broken = violations.iter().all(|v| v["limits_broken"].as_u64().unwrap_or(0) > 0);
    Ok(Row::new(
        "4",
        "Appendix A.1: extremes and condition number of every reading agree with the reference; every reading breaks the limits of Table 1",
        "1e-6°, condition 1e-6 relative, stated as violating",
        json!({ "angle_deg": angle, "condition_relative": relative, "readings": violations }),
        format!(
            "{angle:.1e}°, {relative:.1e}; {} of {} readings break limits",
            violations.iter().filter(|v| v["limits_broken"].as_u64().unwrap_or(0) > 0).count(),
            violations.len()
        ),
        angle <= 1e-6 && relative <= 1e-6 && broken,
    ))
}

/// Designs a trajectory and checks its limits on a grid that is finer than the search's.
pub(super) fn designed(
    arm: &Arm,
    settings: &Settings,
    run: &RunSettings,
    columns: Columns,
) -> Result<Option<Designed>, StudyError> {
    let problem = problem(arm, settings, columns)?;
    let search =
        SearchSettings { starts: if run.quick { 4 } else { 8 }, seed: run.seed, ..SearchSettings::default() };
    let outcome = design(&problem, &search, Vec::new(), &mut |_| {}).map_err(DesignError::from)?;
    let Outcome::Found(design) = outcome else { return Ok(None) };
    let starts = conditions_of_starts(&design);
    let Some(condition) = condition(&problem, &design.coefficients) else { return Ok(None) };
    let broken = limit_points(&problem, &design.coefficients, 4 * FINE, 0.0);
    Ok(broken.is_empty().then_some(Designed { rows: design.coefficients, condition, starts }))
}

/// Row 5.
pub(super) fn own_trajectory(designed: Option<&Designed>) -> Row {
    let condition = designed.map(|d| d.condition);
    Row::new(
        "5",
        "An own trajectory within all limits of Table 1, torque and workspace, on a grid 80 times finer than the search's",
        "condition of the 15 inertial columns at most 40 (reference 35.46)",
        json!({ "condition": condition, "starts": designed.map(|d| &d.starts) }),
        condition.map_or_else(|| "no feasible trajectory".to_owned(), |c| format!("{c:.2}")),
        condition.is_some_and(|c| c <= 40.0),
    )
}

/// Row c: better than the reference.
pub(super) fn better_trajectory(inertial: Option<&Designed>, with_friction: Option<&Designed>) -> Row {
    let (own, other) = (inertial.map(|d| d.condition), with_friction.map(|d| d.condition));
    let words = |c: Option<f64>| c.map_or_else(|| "none".to_owned(), |c| format!("{c:.2}"));
    Row::new(
        "c",
        "Own trajectories are at least as good as the reference's",
        "condition at most 35.4 for 15 columns or 74 for 24",
        json!({ "inertial": own, "with_linear_friction": other }),
        format!("{} and {}", words(own), words(other)),
        own.is_some_and(|c| c <= 35.4) && other.is_some_and(|c| c <= 74.0),
    )
}
