//! Row 10: trajectories of our own, from the printed one.

use dynid::design::DesignError;
use dynid::excitation::criterion::{Criterion, Measure};
use dynid::excitation::{Outcome, Settings as SearchSettings, design, limit_points};
use serde_json::json;

use super::pointing::Pointing;
use super::problem::{FINE, conditions, problem};
use super::settings::Settings;
use super::trajectory::{at_start, travel};
use crate::excitation::conditions_of_starts;
use crate::{Row, RunSettings, StudyError};

/// A designed trajectory.
#[derive(Debug)]
pub(super) struct Designed {
    pub(super) rows: Vec<Vec<f64>>,
    /// See [`conditions`].
    pub(super) conditions: [f64; 2],
    /// Limits broken at any of [`FINE`] instants.
    pub(super) broken: usize,
    /// Largest of position, velocity and acceleration at the start.
    pub(super) start: [f64; 3],
    /// From least to greatest position of every joint, rad.
    pub(super) travel: Vec<f64>,
    /// What is minimised, of random starts within the limits, the best first.
    pub(super) random: Vec<f64>,
}

impl Designed {
    fn keeps_everything(&self) -> bool {
        self.broken == 0 && self.start.iter().all(|x| *x <= 1e-6)
    }
}

/// Two trajectories from Table 1, each the best by its own criterion.
#[derive(Debug)]
pub(super) struct Designs {
    pub(super) printed: [f64; 2],
    pub(super) unit_norm: Option<Designed>,
    pub(super) raw: Option<Designed>,
}

impl Designs {
    pub(super) fn new(
        pointing: &Pointing,
        settings: &Settings,
        run: &RunSettings,
    ) -> Result<Self, StudyError> {
        let [raw, unit_norm] = [Criterion::raw(Measure::Condition), Criterion::unit_norm(Measure::Condition)];
        let problem = problem(pointing, settings, settings.base_frequency, raw.clone())?;
        Ok(Designs {
            printed: conditions(&problem, &settings.trajectory, settings.samples),
            unit_norm: designed(pointing, settings, run, settings.base_frequency, unit_norm)?,
            raw: designed(pointing, settings, run, settings.base_frequency, raw)?,
        })
    }
}

/// From Table 1 at its own frequency, at others from random trajectories.
pub(super) fn designed(
    pointing: &Pointing,
    settings: &Settings,
    run: &RunSettings,
    base_frequency: f64,
    criterion: Criterion,
) -> Result<Option<Designed>, StudyError> {
    let problem = problem(pointing, settings, base_frequency, criterion)?;
    let from_print = SearchSettings {
        starts: 1,
        seed: run.seed,
        from: Some(settings.trajectory.clone()),
        ..SearchSettings::default()
    };
    let at_random =
        SearchSettings { starts: if run.quick { 2 } else { 8 }, from: None, ..from_print.clone() };
    let first = if base_frequency == settings.base_frequency { &from_print } else { &at_random };
    let Outcome::Found(found) =
        design(&problem, first, Vec::new(), &mut |_| {}).map_err(DesignError::from)?
    else {
        return Ok(None);
    };
    let random = match design(&problem, &at_random, Vec::new(), &mut |_| {}).map_err(DesignError::from)? {
        Outcome::Found(random) => conditions_of_starts(&random),
        Outcome::Infeasible(_) => Vec::new(),
    };
    let rows = found.coefficients;
    Ok(Some(Designed {
        conditions: conditions(&problem, &rows, settings.samples),
        broken: limit_points(&problem, &rows, FINE, 0.0).len(),
        start: at_start(base_frequency, &rows)?,
        travel: travel(settings, &rows)?,
        random,
        rows,
    }))
}

/// What unit columns leave out of sight.
fn small(travel: &[f64], raw: f64) -> String {
    let joints: Vec<String> = travel.iter().map(|x| format!("{x:.2e}")).collect();
    format!(" with travels of {} rad and a raw condition of {raw:.1e}", joints.join(" and "))
}

pub(super) fn row(designs: &Designs) -> Row {
    let reached = |designed: &Option<Designed>, which: usize| {
        designed.as_ref().filter(|d| d.keeps_everything()).map(|d| d.conditions[which])
    };
    let (raw, unit_norm) = (reached(&designs.raw, 0), reached(&designs.unit_norm, 1));
    let words = |found: Option<f64>| found.map_or_else(|| "none".to_owned(), |c| format!("{c:.3}"));
    let numbers = |designed: &Option<Designed>| {
        designed.as_ref().map(|d| {
            json!({ "raw": d.conditions[0], "unit_norm": d.conditions[1], "limits_broken": d.broken,
                    "start": d.start, "travel": d.travel, "from_random_starts": d.random })
        })
    };
    let start = [&designs.raw, &designs.unit_norm].into_iter().flatten().flat_map(|d| d.start);
    Row::new(
        "10",
        "From Table 1 the optimiser finds better trajectories within all limits, from rest to rest at zero",
        "condition with unit columns at most 2.0, raw at most 150; limits at 8000 instants; start 1e-6",
        json!({
            "table1": { "raw": designs.printed[0], "unit_norm": designs.printed[1] },
            "best_unit_norm": numbers(&designs.unit_norm),
            "best_raw": numbers(&designs.raw),
        }),
        format!(
            "unit columns {} (Table 1: {:.3}){}, raw {} (Table 1: {:.1}); start {:.1e}",
            words(unit_norm),
            designs.printed[1],
            designs.unit_norm.as_ref().map_or_else(String::new, |d| small(&d.travel, d.conditions[0])),
            words(raw),
            designs.printed[0],
            start.fold(0.0, f64::max),
        ),
        unit_norm.is_some_and(|c| c <= 2.0) && raw.is_some_and(|c| c <= 150.0),
    )
}
