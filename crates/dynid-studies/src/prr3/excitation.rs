//! Row B5: trajectories of the platform designed within the limits of sliders and legs.

use dynid::design::DesignError;

use dynid::excitation::{
    Outcome, Problem, Settings as SearchSettings, design, limit_points, random_trajectory,
};
use dynid::motion::trajectory::{Form, RowOrder};
use rayon::prelude::*;
use serde_json::json;

use super::machine::{Machine, Plane};
use super::problem::{criterion, problem};
use super::settings::Settings;
use super::trajectory;
use crate::{Row, RunSettings, StudyError};

/// Instants of the period at which limits are checked.
const FINE: usize = 8000;
/// Starts of the row.
const RESTARTS: usize = 3;
/// `G` above which a trajectory is a poor one, and random trajectories drawn to find such.
const POOR: f64 = 1e5;
const MOST_DRAWS: u64 = 50;

/// A random trajectory and what became of it.
#[derive(Debug)]
pub(super) struct Designed {
    pub(super) seed: u64,
    /// `G` at the start and at the end.
    pub(super) start: f64,
    pub(super) end: f64,
    /// Largest normalised excess over a limit.
    pub(super) excess: f64,
    /// Largest slider force with friction, N.
    pub(super) force: f64,
    pub(super) evaluations: usize,
    pub(super) rows: Vec<Vec<f64>>,
}

/// Designs from random trajectories, and the reference.
#[derive(Debug)]
pub(super) struct Designs {
    pub(super) reference: f64,
    pub(super) found: Vec<Designed>,
    /// Largest force that sliders may use, N.
    force_limit: f64,
}

impl Designs {
    pub(super) fn new(machine: &Machine, settings: &Settings, run: &RunSettings) -> Result<Self, StudyError> {
        let problem = problem(machine, settings, settings.limits.angle)?;
        let reference = trajectory::identification(settings)?.to_rows(Form::Plain, &RowOrder::default())?;
        let mut starts = Vec::new();
        for seed in run.seed..run.seed + MOST_DRAWS {
            let Some(rows) = random_trajectory(&problem, seed) else { continue };
            if criterion(&problem, settings, &rows) > POOR {
                starts.push((seed, rows));
            }
            if starts.len() == RESTARTS {
                break;
            }
        }
        let found: Vec<Option<Designed>> = starts
            .into_par_iter()
            .map(|(seed, start)| designed(machine, settings, &problem, (seed, start)))
            .collect::<Result<_, _>>()?;
        let bodies = machine.model.machine().mechanism().bodies();
        let force = bodies.iter().filter_map(|b| b.joint.limits.effort).fold(f64::INFINITY, f64::min);
        Ok(Designs {
            reference: criterion(&problem, settings, &reference),
            found: found.into_iter().flatten().collect(),
            force_limit: force,
        })
    }

    pub(super) fn best(&self) -> Option<&Designed> {
        self.found.iter().min_by(|a, b| a.end.total_cmp(&b.end))
    }

    /// Row B5.
    pub(super) fn row(&self) -> Row {
        let best = self.best().map_or(f64::INFINITY, |d| d.end);
        let keeps = |d: &&Designed| d.excess <= 1e-3 && d.force <= self.force_limit;
        let good = self.found.iter().filter(|d| d.start > POOR && d.end < 1000.0).filter(keeps).count();
        let told = |d: &Designed| format!("{:.1e} to {:.0}", d.start, d.end);
        let numbers = |d: &Designed| {
            json!({ "seed": d.seed, "start": d.start, "end": d.end, "largest_excess": d.excess,
                    "largest_force": d.force, "evaluations": d.evaluations })
        };
        Row::new(
            "B5",
            "In coordinates of the platform the optimiser makes good trajectories of random ones, within the limits of sliders and legs",
            "3 of 3 random trajectories with G > 1e5 to G < 1000, limits to 1e-3; best at most 1.5 times the reference's G",
            json!({ "reference": self.reference, "designs": self.found.iter().map(numbers).collect::<Vec<_>>() }),
            format!(
                "G {} (reference {:.0}); largest excess {:.1e}, largest force {:.0} N",
                self.found.iter().map(told).collect::<Vec<_>>().join(", "),
                self.reference,
                self.found.iter().map(|d| d.excess).fold(f64::NEG_INFINITY, f64::max),
                self.found.iter().map(|d| d.force).fold(0.0, f64::max),
            ),
            good == RESTARTS && best <= 1.5 * self.reference,
        )
    }
}

fn designed(
    machine: &Machine,
    settings: &Settings,
    problem: &Problem,
    (seed, start): (u64, Vec<Vec<f64>>),
) -> Result<Option<Designed>, StudyError> {
    let search = SearchSettings {
        starts: 1,
        seed,
        from: Some(start.clone()),
        report_samples: settings.criterion.samples,
        ..SearchSettings::default()
    };
    let Outcome::Found(found) =
        design(problem, &search, Vec::new(), &mut |_| {}).map_err(DesignError::from)?
    else {
        return Ok(None);
    };
    let motion = trajectory::designed_motion(settings, &found.coefficients, settings.trajectory.samples)?;
    let forces = trajectory::true_forces(machine, settings, &motion, Plane::Horizontal)?;
    let excess = limit_points(problem, &found.coefficients, FINE, f64::NEG_INFINITY);
    Ok(Some(Designed {
        seed,
        start: criterion(problem, settings, &start),
        end: criterion(problem, settings, &found.coefficients),
        excess: excess.first().map_or(f64::INFINITY, |p| p.excess),
        force: forces.drives.iter().flat_map(|d| &d.effort).fold(0.0, |m: f64, e| m.max(e.abs())),
        evaluations: found.best().evaluations,
        rows: found.coefficients,
    }))
}
