//! Stiffness of elastic joints from encoders on both sides of their gears, by the deformation that they show.
//!
//! The row of a link behind a spring without torque sensor has effort zero: `0 = Y β - k δ` is fitted by `β = 0, k = 0`, whatever the sensors.
//! What is measured is the deformation `δ = θ/N - q`, so it is what carries the noise here: `δ = Y β / k + z + τ q̇ + h sign(θ̇)` beside
//! the sums of link and motor rows, in which the spring is gone. Where this does not bear out the stiffness that the fit of the
//! robot's rows found, the joints are taken as stiff ones, and the stiffness stands beside the model.

mod deformed;
mod rows;
mod stiff;

use dynid_clearance::deformation::{Deformation, Evidence, fit, judge};
use dynid_model::{EffortModel, MotionBlock, RobotModel};
use dynid_rows::conditioning::PreparedLog;

use crate::Error;
use crate::elements::ElementPlan;
use crate::identification::Identification;
pub use crate::joint_stiffness::{JointStiffness, StiffJoint, StiffnessVerdict};
pub(crate) use deformed::{Deformed, Sieve, Smooth};
use rows::{LogRows, rows};
pub(crate) use stiff::{BEHIND_GEAR, at_motors, stiff_robot, stiff_settings};

/// The record of the links is moved by the lag found so often.
const ROUNDS: usize = 3;
/// Standard deviations in half an interval.
const HALF: f64 = 2.0;

/// An elastic joint: outputs of its link and motor, ratio, columns of its spring.
struct Spring {
    link: usize,
    motor: usize,
    ratio: f64,
    cubic: bool,
    columns: Vec<usize>,
}

fn springs(model: &RobotModel) -> Vec<Spring> {
    let table = model.parameters();
    let outputs = model.outputs();
    (0..outputs.len())
        .filter_map(|motor| {
            let (link, ratio) = model.elastic_link(motor)?;
            let of = |symbol: &str| table.column(&format!("{}.{symbol}", outputs[link].name));
            let columns = ["k1", "k2", "d"].into_iter().filter_map(of).collect();
            Some(Spring { link, motor, ratio, cubic: of("k2").is_some(), columns })
        })
        .collect()
}

/// What the training logs tell of the stiffness of every elastic joint; empty without such joints, and where sensors measure the load.
///
/// # Errors
/// [`Error::Conditioning`] where a signal cannot be filtered.
pub(crate) fn of(id: &Identification) -> Result<Vec<JointStiffness>, Error> {
    let springs = springs(&id.model);
    if springs.is_empty() || id.plan.is_measured() {
        return Ok(Vec::new());
    }
    let mut lag_s = 0.0;
    let mut last = None;
    for _ in 0..ROUNDS {
        let Some(all) = rows(id, &springs, lag_s)? else { return Ok(Vec::new()) };
        let Ok(found) = fit(&all.rows, &all.settings) else { return Ok(Vec::new()) };
        let here = lag_s;
        // One clock: the lag that all joints share, each by its precision.
        let (sum, weight) = found.likelihood.joints.iter().fold((0.0, 0.0), |(sum, weight), joint| {
            let own = joint.std[1].max(f64::MIN_POSITIVE).powi(-2);
            (sum + own * joint.nuisances[0], weight + own)
        });
        lag_s += sum / weight;
        last = Some((all, found, here));
    }
    let Some((all, found, here)) = last else { return Ok(Vec::new()) };
    let one = |(j, spring)| told(id, spring, j, (&all, &found), here);
    Ok(springs.iter().enumerate().map(one).collect())
}

/// Elastic joints of an identification, for them to be taken as stiff ones.
pub(crate) fn stiff_joints(id: &Identification) -> Vec<StiffJoint> {
    let (model, table) = (&id.model, id.model.parameters());
    let none = vec![0.0; model.outputs().len()];
    let channels: Vec<(&str, &[f64])> = match id.logs.first() {
        Some(log) => log.channels.iter().map(|c| (c.name.as_str(), &c.values[..1])).collect(),
        None => Vec::new(),
    };
    let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(1, &none, &none, &none) };
    let joint = |spring: &Spring| {
        let name = &model.outputs()[spring.link].name;
        let spec = id.plan.elastic.iter().find(|spec| spec.joint == *name)?.clone();
        let friction = model.friction_columns(spring.link, &table.shape_start(), &motion);
        let loads = model
            .layout()
            .columns(spring.link)
            .iter()
            .filter(|c| !spring.columns.contains(c) && friction.iter().all(|(column, _)| column != *c));
        Some(StiffJoint { spec, loads: loads.map(|c| table.linear[*c].name.clone()).collect() })
    };
    springs(model).iter().filter_map(joint).collect()
}

/// What to know about a stiffness where the deformation is not asked, in words.
pub fn of_rows_alone(plan: &ElementPlan) -> Option<String> {
    let joints: Vec<&str> = plan.elastic.iter().filter(|e| !e.sensor).map(|e| e.joint.as_str()).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "stiffness of `{}` is that of the rows of links, whose effort is zero: it falls to nothing where encoders are read at different \
             times or gears have errors of their own; `dynid identify` compares it with the deformation",
            joints.join("`, `")
        )
    })
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

fn deviation(x: &[f64]) -> f64 {
    let middle = mean(x);
    (x.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / x.len().max(1) as f64).sqrt()
}

/// Slope of a signal on another, both without their means; 0 where the other is constant.
fn slope(signal: &[f64], on: &[f64]) -> f64 {
    let (a, b) = (mean(signal), mean(on));
    let both: f64 = signal.iter().zip(on).map(|(x, y)| (x - a) * (y - b)).sum();
    let own: f64 = on.iter().map(|y| (y - b).powi(2)).sum();
    if own > 0.0 { both / own } else { 0.0 }
}

fn told(
    id: &Identification,
    spring: &Spring,
    j: usize,
    (all, found): (&LogRows, &Deformation),
    lag_s: f64,
) -> JointStiffness {
    /// Place of the hysteresis among the nuisances, behind the lag.
    const HYSTERESIS: usize = 1;
    let own = &found.likelihood.joints[j];
    let std_total = found.std_total[j];
    let of_efforts = &found.two_step.joints[j].load;
    let noise = |output: usize| {
        let sigma = id.logs.iter().map(|l| l.position_noise[output].sigma);
        sigma.fold(0.0, f64::max)
    };
    let verdict = judge(&Evidence {
        compliance: own.compliance,
        once_per_turn: found.once_per_turn[j],
        std_total,
        std: own.std[0],
        load: &own.load,
        load_of_efforts: of_efforts,
        load_alone: own.load_alone,
        noise: noise(spring.link).hypot(noise(spring.motor) / spring.ratio),
        samples: id.logs.iter().map(PreparedLog::samples).sum(),
    });
    let upper = own.compliance + HALF * std_total;
    let is_told = verdict.is_told();
    let spread = |k: usize| own.std[1 + k].max(found.jackknife[j][1 + k]);
    JointStiffness {
        joint: id.model.outputs()[spring.link].name.clone(),
        verdict: verdict.into(),
        compliance: own.compliance,
        compliance_std: std_total,
        stiffness: is_told.then(|| 1.0 / own.compliance),
        interval: is_told.then(|| (1.0 / upper, 1.0 / (own.compliance - HALF * std_total))),
        stiffness_at_least: (!is_told && !verdict.is_degenerate() && upper > 0.0).then(|| 1.0 / upper),
        lag_s: (lag_s + own.nuisances[0], spread(0)),
        hysteresis: (own.nuisances[HYSTERESIS], spread(HYSTERESIS)),
        by_load: (own.compliance * own.load_alone).abs(),
        residual: own.rms,
        load: deviation(of_efforts),
        of_rows: spring.columns.first().map_or(0.0, |c| id.values()[*c]),
        slope_of_rows: slope(&all.springs[j], of_efforts),
        cubic: spring.cubic,
    }
}
