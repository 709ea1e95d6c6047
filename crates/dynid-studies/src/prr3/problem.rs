//! The design problem: limits of sliders, legs and platform, and what a design is worth.

use super::fault;
use super::machine::Machine;
use super::settings::Settings;
use crate::StudyError;
use dynid::excitation::ClosedExcitation;
use dynid::excitation::ColumnInfo;
use dynid::excitation::DEFAULT_SAMPLES_PER_HARMONIC;
use dynid::excitation::DEFAULT_SIGN_WIDTH;
use dynid::excitation::MotionLimits;
use dynid::excitation::Problem;
use dynid::excitation::StartConditions;
use dynid::excitation::TiedColumn;
use dynid::excitation::constraint::JointLimits;
use dynid::excitation::constraint::JointQuantity;
use dynid::excitation::constraint::JointRange;
use dynid::excitation::criterion::Criterion;
use dynid::excitation::criterion::Measure;
use dynid::excitation::information;
use std::f64::consts::PI;
use std::f64::consts::TAU;

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

const HARMONICS: usize = 5;

/// `G` of a trajectory on the samples of the settings.
pub(super) fn criterion(problem: &Problem, settings: &Settings, rows: &[Vec<f64>]) -> f64 {
    let triangle = information(problem, rows, settings.criterion.samples);
    problem.criterion.value(&triangle).map_or(f64::INFINITY, f64::exp)
}
