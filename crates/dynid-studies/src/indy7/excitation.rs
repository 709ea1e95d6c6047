//! Row 7: excitation trajectories.

use dynid::design::DesignError;
use std::sync::Arc;

use dynid::excitation::constraint::{FramePoint, Region};
use dynid::excitation::{Outcome, Problem, Settings as SearchSettings, design, information, limit_points};
use dynid::model::{RobotModel, Vec3};
use dynid::motion::trajectory::{Form, RowOrder};
use serde_json::json;

use super::experiment::{BASE, trajectory};
use super::robot::{Indy7, rigid};
use super::settings::Settings;
use crate::excitation::{Excitation, conditions_of_starts};
use crate::{Row, RunSettings, StudyError};

/// Samples of the period at 50 Hz.
const SAMPLES: usize = 1000;

/// A designed trajectory.
#[derive(Debug)]
pub(super) struct Designed {
    /// Rows of the paper's form.
    pub(super) rows: Vec<Vec<f64>>,
    pub(super) condition: f64,
    pub(super) condition_40: f64,
    /// Condition of every start that ended within the limits.
    pub(super) starts: Vec<f64>,
}

/// The reference trajectory in plain amplitudes.
pub(super) fn plain_rows(settings: &Settings) -> Result<Vec<Vec<f64>>, StudyError> {
    Ok(trajectory(&settings.trajectories.excitation)?.to_rows(Form::Plain, &RowOrder::default())?)
}

fn problem(arm: &Indy7, settings: &Settings, model: RobotModel) -> Result<Problem, StudyError> {
    let mechanism = &arm.mechanism;
    let mut regions = Vec::new();
    for body in &mechanism.bodies()[3..] {
        let point = FramePoint { frame: body.name.clone(), position: Vec3([0.0; 3]) };
        let floor = Region::HalfSpace { normal: Vec3([0.0, 0.0, 1.0]), offset: settings.limits.height };
        let column = Region::OutsideOrAboveColumn {
            center: [0.0; 2],
            radius: settings.limits.column_radius,
            height: settings.limits.column_height,
        };
        regions.extend([(point.clone(), floor), (point, column)]);
    }
    let excitation = Excitation {
        mechanism,
        base: BASE,
        samples: SAMPLES,
        acceleration: &settings.limits.acceleration,
        regions: &regions,
        // Torque limits are far away; the rigid arm with its rotors stands for the whole.
        nominal: (Arc::new(rigid(mechanism)), Vec::new(), arm.standard.clone()),
    };
    excitation.problem(model)
}

/// Condition numbers of the stacked matrix at 50 Hz with 58 and with 40 columns; rows in plain amplitudes.
pub(super) fn conditions(
    arm: &Indy7,
    settings: &Settings,
    plain: &[Vec<f64>],
) -> Result<[f64; 2], StudyError> {
    let of = |model: RobotModel| -> Result<f64, StudyError> {
        let problem = problem(arm, settings, model)?;
        let information = information(&problem, plain, SAMPLES);
        Ok(problem.criterion.value(&information).map_or(f64::INFINITY, f64::exp))
    };
    Ok([of(arm.regression())?, of(rigid(&arm.mechanism))?])
}

/// Designs a trajectory for 58 columns and checks its limits on a grid four times finer than that of the condition.
pub(super) fn designed(
    arm: &Indy7,
    settings: &Settings,
    run: &RunSettings,
) -> Result<Option<Designed>, StudyError> {
    let problem = problem(arm, settings, arm.regression())?;
    let starts = if run.quick { 4 } else { 16 };
    let search = SearchSettings { starts, seed: run.seed, ..SearchSettings::default() };
    let Outcome::Found(found) =
        design(&problem, &search, Vec::new(), &mut |_| {}).map_err(DesignError::from)?
    else {
        return Ok(None);
    };
    if !limit_points(&problem, &found.coefficients, 4 * SAMPLES, 0.0).is_empty() {
        return Ok(None);
    }
    let starts = conditions_of_starts(&found);
    let [condition, condition_40] = conditions(arm, settings, &found.coefficients)?;
    let plain = dynid::motion::trajectory::FourierTrajectory::from_rows(
        BASE,
        Form::Plain,
        &RowOrder::default(),
        &found.coefficients,
        1,
    )?;
    let rows = plain.to_rows(Form::VelocityAmplitudes, &RowOrder::default())?;
    Ok(Some(Designed { rows, condition, condition_40, starts }))
}

/// Row 7, and the row of the better trajectory.
pub(super) fn rows(designed: Option<&Designed>) -> Vec<Row> {
    let words = designed.map_or_else(
        || "no feasible trajectory".to_owned(),
        |d| format!("{:.2} ({:.2} with 40 columns)", d.condition, d.condition_40),
    );
    let measured = json!({
        "condition": designed.map(|d| d.condition),
        "condition_40": designed.map(|d| d.condition_40),
        "starts": designed.map(|d| &d.starts),
    });
    let below = |limit: f64| designed.is_some_and(|d| d.condition <= limit);
    vec![
        Row::new(
            "7",
            "An own trajectory within limits and workspace on a grid four times finer; the paper reaches 80.25",
            "condition of 58 columns at most 80.25, at most 40 expected",
            measured.clone(),
            words.clone(),
            below(40.0),
        ),
        Row::new(
            "a",
            "Own trajectories are better conditioned than the reference's 32.33",
            "condition of 58 columns below 32",
            measured,
            words,
            below(32.0),
        ),
    ]
}
