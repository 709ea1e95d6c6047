//! Friction that takes energy out of the motion, as rows of the consistent estimate.

use dynid_estimate::consistent::Bound;
use dynid_model::element::MaxwellSlip;
use dynid_model::{EffortModel, MotionBlock, Output, RobotModel};
use dynid_rows::conditioning::{ConditioningSettings, JointFriction, Moving, PreparedLog, ShapeKind, States};

use crate::Error;
use crate::elements::ElementPlan;

/// Speeds are looked at in so many parts per direction, equal in the logarithm.
const PARTS: usize = 8;
/// Samples of a log that are looked at.
const SAMPLES: usize = 20_000;

/// What friction has to obey: its power `v · e(v)` is not negative wherever the training logs move the joint.
#[derive(Debug, Default)]
pub(crate) struct FrictionPower {
    /// Rows `Σ factor x ≤ 0`.
    pub(crate) bounds: Vec<Bound>,
    /// Parameters that these rows keep in place of limits of their own.
    pub(crate) kept: Vec<String>,
}

impl FrictionPower {
    /// What earlier logs asked of friction, whose rows stand among the bounds.
    pub(crate) fn of_earlier(kept: Vec<String>) -> Self {
        FrictionPower { bounds: Vec::new(), kept }
    }
}

/// Name of the rows of a joint.
pub(crate) fn bound_name(joint: &str) -> String {
    format!("power of the friction of {joint} ≥ 0")
}

/// Friction of a joint per unit of its parameters at samples at which it moves.
#[derive(Default)]
struct Rows {
    columns: Vec<usize>,
    /// Velocity and effort against the motion, one per column.
    rows: Vec<(f64, Vec<f64>)>,
}

/// Conditions on the friction of all joints whose coefficients are estimated.
///
/// The effort of all friction elements of a joint together, less that at rest, must not act along its velocity. It is linear in the
/// coefficients, so every sample of a log is a condition; those with the extreme columns in each of eight parts of the speeds of
/// a direction stand for all. Samples count from [`Moving::least_speed`] on. Joints with known friction are left out, as are
/// mechanisms with loops: there every coefficient has a limit of its own.
///
/// # Errors
/// [`Error::Conditioning`].
pub(crate) fn limits(
    model: &RobotModel,
    plan: &ElementPlan,
    logs: &[PreparedLog],
    state_hz: f64,
    settings: &ConditioningSettings,
) -> Result<FrictionPower, Error> {
    let mut out = FrictionPower::default();
    if model.closed().is_some() {
        return Ok(out);
    }
    let mut joints: Vec<Rows> = model.outputs().iter().map(|_| Rows::default()).collect();
    for log in logs {
        let states = States::of_motion(log, state_hz, settings)?;
        let moving = Moving::new(log, &states, settings);
        for (rate, joint) in joints.iter_mut().enumerate() {
            if plan.known_friction(&model.outputs()[rate].name).is_none() {
                joint.add(model, rate, log, &states, &moving.samples[rate]);
            }
        }
    }
    let table = &model.parameters().linear;
    for (joint, output) in joints.iter().zip(model.outputs()) {
        let rows = joint.extremes();
        for row in &rows {
            let terms: Vec<(usize, f64)> = joint
                .columns
                .iter()
                .zip(row.iter())
                .filter(|(_, x)| **x != 0.0)
                .map(|(c, x)| (*c, -x))
                .collect();
            if !terms.is_empty() {
                out.bounds.push(Bound { name: bound_name(&output.name), terms, upper: 0.0 });
            }
        }
        // What never shows in steady motion keeps its own limit.
        let shows = |k: usize| rows.iter().any(|row| row[k] != 0.0);
        let spring = format!("{}.{}", output.name, MaxwellSlip::FRICTION.symbol);
        let kept = joint.columns.iter().enumerate();
        let kept = kept.filter(|(k, column)| shows(*k) && table[**column].name != spring);
        out.kept.extend(kept.map(|(_, column)| table[*column].name.clone()));
    }
    Ok(out)
}

/// `fs ≥ fc` where a fall from rest was chosen from the logs: what is named Stribeck friction is.
pub(crate) fn falls(model: &RobotModel, chosen: &[JointFriction]) -> Vec<Bound> {
    let table = model.parameters();
    let of_joint = |(output, joint): (&Output, &JointFriction)| {
        let column = |symbol: &str| table.column(&format!("{}.{symbol}", output.name));
        joint.accepted.iter().find(|t| t.shape.kind == ShapeKind::Stribeck)?;
        let (fs, fc) = (column("fs")?, column("fc")?);
        let name = format!("static friction of {} at least its Coulomb friction", output.name);
        Some(Bound { name, terms: vec![(fc, 1.0), (fs, -1.0)], upper: 0.0 })
    };
    model.outputs().iter().zip(chosen).filter_map(of_joint).collect()
}

impl FrictionPower {
    /// The model without limits on single coefficients that the rows keep.
    pub(crate) fn free(&self, model: RobotModel) -> RobotModel {
        model.with_free_sign(|p| self.kept.contains(&p.name))
    }
}

impl Rows {
    /// Adds the samples of a log at which the joint moves, off the transients of the state filter.
    fn add(&mut self, model: &RobotModel, rate: usize, log: &PreparedLog, states: &States, moves: &[bool]) {
        let margin = (states.rate_hz / states.cutoff_hz).ceil() as usize;
        let mut bad: Vec<bool> = log.usable.iter().map(|u| !u).collect();
        bad = dynid_motion::mask::dilate(&bad, margin);
        dynid_motion::mask::merge(&mut bad, &dynid_motion::mask::edges(states.samples, margin));
        let samples: Vec<usize> = (0..states.samples).filter(|k| moves[*k] && !bad[*k]).collect();
        let samples: Vec<usize> =
            samples.iter().copied().step_by(samples.len().div_ceil(SAMPLES).max(1)).collect();
        let n = samples.len();
        if n == 0 {
            return;
        }
        let pick = |signal: &[f64]| -> Vec<f64> { samples.iter().map(|k| signal[*k]).collect() };
        let outputs = 0..states.outputs();
        let q: Vec<f64> = outputs.clone().flat_map(|output| pick(states.position(output))).collect();
        let dq: Vec<f64> = outputs.clone().flat_map(|output| pick(&states.velocity(output))).collect();
        let ddq: Vec<f64> = outputs.flat_map(|output| pick(&states.acceleration(output))).collect();
        let mut rest = dq.clone();
        rest[rate * n..][..n].fill(0.0);
        let channels: Vec<(&str, Vec<f64>)> =
            log.channels.iter().map(|c| (c.name.as_str(), pick(&c.values))).collect();
        let shape = model.parameters().shape_start();
        // A spring gives back what it took: where it drives, the friction beside it has to oppose the motion by itself.
        let spring = format!("{}.{}", model.outputs()[rate].name, MaxwellSlip::SPRING);
        let remembered = states.remembered(model, &shape, &log.channels);
        let opposing = |values: &[f64]| -> Vec<f64> {
            let velocity = &dq[rate * n..][..n];
            let against = |(w, v): (f64, &f64)| if w * v > 0.0 { w } else { 0.0 };
            pick(values).into_iter().zip(velocity).map(against).collect()
        };
        let spring =
            remembered.iter().find(|c| c.name == spring).map(|c| (c.name.as_str(), opposing(&c.values)));
        let channels: Vec<(&str, &[f64])> =
            channels.iter().chain(&spring).map(|(name, x)| (*name, x.as_slice())).collect();
        let columns = |dq: &[f64]| {
            let motion = MotionBlock { channels: &channels, ..MotionBlock::plain(n, &q, dq, &ddq) };
            model.friction_columns(rate, &shape, &motion)
        };
        let (moving, rest) = (columns(&dq), columns(&rest));
        self.columns = moving.iter().map(|(column, _)| *column).collect();
        let velocity = &dq[rate * n..][..n];
        self.rows.extend(velocity.iter().enumerate().map(|(s, v)| {
            let against = moving.iter().zip(&rest).map(|((_, at), (_, zero))| v.signum() * (at[s] - zero[s]));
            (*v, against.collect())
        }));
    }

    /// In every part of the speeds of a direction the rows with the least and the greatest entry of each column.
    fn extremes(&self) -> Vec<&[f64]> {
        let speeds = || self.rows.iter().map(|(v, _)| v.abs());
        let (least, most) = (speeds().fold(f64::INFINITY, f64::min), speeds().fold(0.0, f64::max));
        let width = (most / least).ln().max(f64::MIN_POSITIVE) / PARTS as f64;
        let part = |v: f64| ((v.abs() / least).ln() / width).floor().min(PARTS as f64 - 1.0) as usize;
        let mut parts: Vec<Vec<usize>> = vec![Vec::new(); 2 * PARTS];
        for (k, (v, _)) in self.rows.iter().enumerate() {
            parts[2 * part(*v) + usize::from(*v > 0.0)].push(k);
        }
        let mut chosen: Vec<usize> = Vec::new();
        for members in &parts {
            for column in 0..self.columns.len() {
                let order = |a: &&usize, b: &&usize| {
                    self.rows[**a].1[column].total_cmp(&self.rows[**b].1[column]).then(a.cmp(b))
                };
                chosen.extend(members.iter().min_by(order));
                chosen.extend(members.iter().max_by(order));
            }
        }
        chosen.sort_unstable();
        chosen.dedup();
        chosen.into_iter().map(|k| self.rows[k].1.as_slice()).collect()
    }
}
