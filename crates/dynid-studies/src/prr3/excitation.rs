//! Row B5: trajectories of the platform designed within the limits of sliders and legs.

use dynid::fault::DesignError;
use std::f64::consts::{PI, TAU};

use dynid::excitation::constraint::{JointLimits, JointQuantity, JointRange};
use dynid::excitation::criterion::{Criterion, Measure};
use dynid::excitation::{
    ClosedExcitation, ColumnInfo, DEFAULT_SAMPLES_PER_HARMONIC, DEFAULT_SIGN_WIDTH, MotionLimits, Outcome,
    Problem, Settings as SearchSettings, StartConditions, TiedColumn, design, information, limit_points,
    random_trajectory,
};
use dynid::motion::trajectory::{Form, RowOrder};
use rayon::prelude::*;
use serde_json::json;

use super::machine::{Machine, Plane};
use super::settings::Settings;
use super::{fault, trajectory};
use crate::{Row, RunSettings, StudyError};

const HARMONICS: usize = 5;
/// Instants of the period at which limits are checked.
const FINE: usize = 8000;
/// Starts of the row.
const RESTARTS: usize = 3;
/// `G` above which a trajectory is a poor one, and random trajectories drawn to find such.
const POOR: f64 = 1e5;
const MOST_DRAWS: u64 = 50;

fn ranges(machine: &Machine, settings: &Settings) -> Result<Vec<JointRange>, StudyError> {
    let closed = machine.model.machine();
    let (bodies, owners) = (closed.mechanism().bodies(), closed.mechanism().rate_bodies());
    let limits = &settings.limits;
    let mut ranges = Vec::new();
    let mut range =
        |subject: String, quantity, terms: &[(usize, f64)], (lower, upper): (f64, f64), scale, unit| {
            ranges.push(JointRange { subject, quantity, terms: terms.to_vec(), lower, upper, scale, unit });
        };
    let symmetric = |most: f64| (-most, most);
    for rate in closed.driven() {
        let joint = &bodies[owners[*rate]].joint;
        let (name, own) = (&joint.name, [(*rate, 1.0)]);
        let (low, high) = joint.limits.position.ok_or_else(|| fault(format!("no range of `{name}`")))?;
        let speed = joint.limits.velocity.ok_or_else(|| fault(format!("no speed of `{name}`")))?;
        let acceleration = limits.slider_acceleration;
        range(name.clone(), JointQuantity::Position, &own, (low, high), 0.5 * (high - low), "m");
        range(name.clone(), JointQuantity::Rate, &own, symmetric(speed), speed, "m/s");
        range(name.clone(), JointQuantity::Acceleration, &own, symmetric(acceleration), acceleration, "m/s²");
    }
    let &[first, second, third] = closed.driven() else { return Err(fault("three sliders")) };
    for ((from, to), least) in [(second, first), (first, third)].into_iter().zip(limits.distances) {
        let names = [from, to].map(|r| bodies[owners[r]].joint.name.as_str());
        let subject = format!("{} to {}", names[0], names[1]);
        range(subject, JointQuantity::Position, &[(to, 1.0), (from, -1.0)], (least, f64::INFINITY), 0.5, "m");
    }
    for (name, length) in &limits.legs {
        let joint = closed.mechanism().joint_index(name).map_err(fault)?;
        let rate = bodies[joint].rate;
        let (low, high) = ((limits.height[0] / length).asin(), limits.height[1].asin());
        // The home pose tells to which side a leg leans.
        let leans_back = closed.home()[closed.position_of(rate)] > 0.5 * PI;
        let within = if leans_back { (PI - high, PI - low) } else { (low, high) };
        range(format!("height of {name}"), JointQuantity::Position, &[(rate, 1.0)], within, 1.0, "rad");
    }
    Ok(ranges)
}

/// Limits of sliders and legs.
pub(super) fn joints(machine: &Machine, settings: &Settings) -> Result<JointLimits, StudyError> {
    JointLimits::new(machine.model.clone(), ranges(machine, settings)?).map_err(fault)
}

/// Trajectories of five harmonics, from rest to rest, with the platform's angle within `±angle`.
pub(super) fn problem(machine: &Machine, settings: &Settings, angle: f64) -> Result<Problem, StudyError> {
    let (limits, criterion) = (&settings.limits, &settings.criterion);
    let column = |name: &String| {
        let place = settings.place(name)?;
        let own = &settings.parameter[place];
        let info = ColumnInfo { name: name.clone(), unit: own.unit.clone(), nominal: Some(own.estimate) };
        Ok(TiedColumn { info, factors: machine.ties[place].clone() })
    };
    let columns = settings.base_columns.iter().map(column).collect::<Result<Vec<_>, StudyError>>()?;
    let of = |position, k: usize| MotionLimits {
        position,
        velocity: limits.speed[k],
        acceleration: limits.acceleration[k],
        jerk: f64::INFINITY,
    };
    let outputs = machine.driven().len();
    Ok(Problem {
        model: Box::new(ClosedExcitation::new(machine.model.clone(), Vec::new(), columns)),
        coordinates: settings.platform.clone(),
        limits: vec![of(limits.x, 0), of(limits.y, 0), of((-angle, angle), 1)],
        constraints: vec![Box::new(joints(machine, settings)?)],
        base: TAU / settings.trajectory.period,
        harmonics: HARMONICS,
        start: StartConditions { rest: true, ..StartConditions::default() },
        criterion: Criterion::raw(Measure::ConditionAndSmallest {
            condition: criterion.condition,
            smallest: criterion.smallest,
        }),
        output_weights: vec![1.0; outputs],
        effective_samples: criterion.samples as f64,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: HARMONICS * DEFAULT_SAMPLES_PER_HARMONIC,
    })
}

/// `G` of a trajectory on the samples of the settings.
fn criterion(problem: &Problem, settings: &Settings, rows: &[Vec<f64>]) -> f64 {
    let triangle = information(problem, rows, settings.criterion.samples);
    problem.criterion.value(&triangle).map_or(f64::INFINITY, f64::exp)
}

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
