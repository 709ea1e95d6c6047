//! Whether a written robot gives the identified effort.

use dynid_identify::Error;
use dynid_model::closed::ClosedMechanism;
use dynid_model::element::{Coulomb, JointElement, LuGre, MaxwellSlip, RotorInertia, Spring, Viscous, sign};
use dynid_model::{
    ClosedModel, Description, EffortModel, Mechanism, MotionBlock, RandomMotion, RegressorBlock, RobotModel,
    TreeModel,
};
use dynid_motion::Channel;
use dynid_robots::mjcf::JointParameters;
use dynid_rows::conditioning::{ConditioningSettings, PreparedLog, States};

use super::READ_BACK_LIMIT;
use super::error::ExportError;

/// Random states of a check without logs.
const STATES: usize = 1000;
/// Seed of these states: a robot is always checked at the same ones.
const SEED: u64 = 1;
/// Samples that are evaluated at once.
const BLOCK: usize = 256;
/// Blocks of a log that are evaluated, evenly spread.
const BLOCKS: usize = 64;

/// States at which an exported robot is compared with the identified model.
#[derive(Debug)]
pub struct CheckStates(Kind);

#[derive(Debug)]
enum Kind {
    Random(RandomMotion),
    Logs(Vec<(States, Vec<Channel>)>),
}

impl CheckStates {
    /// A thousand seeded random states within the limits of the model's joints (±π rad, ±1 m where there are none;
    /// rates within ±2, accelerations within ±5).
    pub fn random(model: &RobotModel) -> Self {
        CheckStates(Kind::Random(match model.closed() {
            None => RandomMotion::new(model.mechanism(), model.channels(), STATES, SEED)
                .with_coordinates(model, SEED),
            Some(closed) => closed.random_motion(STATES, SEED),
        }))
    }

    /// Random states as those of [`CheckStates::random`] for two models of one robot, with what either of them reads beside the motion.
    pub fn random_of_both(a: &RobotModel, b: &RobotModel) -> Self {
        let others = b.channels().iter().filter(|name| !a.channels().contains(name));
        let channels: Vec<String> = a.channels().iter().chain(others).cloned().collect();
        CheckStates(Kind::Random(match a.closed() {
            None => RandomMotion::new(a.mechanism(), &channels, STATES, SEED).with_coordinates(a, SEED),
            Some(closed) => closed.random_motion(STATES, SEED),
        }))
    }

    /// States of logs, positions filtered at `state_hz`: up to 64 runs of 256 samples from each, evenly spread.
    ///
    /// # Errors
    /// [`Error::Conditioning`]: a log is too short for the filter.
    pub fn logs(logs: &[PreparedLog], state_hz: f64, settings: &ConditioningSettings) -> Result<Self, Error> {
        let states =
            logs.iter().map(|log| Ok((States::of_motion(log, state_hz, settings)?, log.channels.clone())));
        Ok(CheckStates(Kind::Logs(states.collect::<Result<_, Error>>()?)))
    }

    /// The states in words.
    pub fn describe(&self) -> String {
        match &self.0 {
            Kind::Random(_) => format!("{STATES} random states"),
            Kind::Logs(logs) => {
                let samples: usize =
                    logs.iter().map(|(s, _)| starts(s.samples).map(|r| r.len()).sum::<usize>()).sum();
                format!("{samples} states of the log{}", if logs.len() == 1 { "" } else { "s" })
            }
        }
    }

    /// Samples that a block may have.
    pub(crate) fn room(&self) -> usize {
        if matches!(self.0, Kind::Random(_)) { STATES } else { BLOCK }
    }

    /// Hands over all states, block by block.
    pub fn for_each_block(&self, mut work: impl FnMut(&MotionBlock<'_>)) {
        match &self.0 {
            Kind::Random(motion) => motion.with_block(work),
            Kind::Logs(logs) => {
                for (states, channels) in logs {
                    for range in starts(states.samples) {
                        states.with_block(range, channels, &[], &mut work);
                    }
                }
            }
        }
    }
}

/// Runs of a log that are looked at.
fn starts(samples: usize) -> impl Iterator<Item = std::ops::Range<usize>> {
    let step = samples.div_ceil(BLOCKS).max(BLOCK);
    (0..samples).step_by(step).map(move |from| from..(from + BLOCK).min(samples))
}

/// A model of what was read back, its joints in the order of another model, with the values that the file states.
///
/// `held`: joints of the file that the other model holds still. `Err` says why the two are different robots.
pub(crate) fn compile(
    mut description: Description,
    joints: &[JointParameters],
    held: &[(String, f64)],
    like: &RobotModel,
) -> Result<(RobotModel, Vec<f64>), String> {
    let order = |name: &str| like.mechanism().bodies().iter().position(|b| b.joint.name == name);
    description.couple_mimics = like.mechanism().follows().is_some();
    description.lock(held).map_err(|e| e.to_string())?;
    description.joints.sort_by_key(|j| order(&j.name).unwrap_or(usize::MAX));
    let mechanism = description.build().map_err(|e| e.to_string())?;
    let rates = mechanism.rate_names();
    if like.mechanism().bodies().is_empty() {
        return Ok((RobotModel::new(mechanism.clone(), Vec::new()), mechanism.inertia_vector()));
    }
    if rates != like.mechanism().rate_names() {
        return Err(format!(
            "expected the moving joints {}, found {}",
            like.mechanism().rate_names().join(", "),
            rates.join(", ")
        ));
    }
    let values = mechanism.inertia_vector();
    with_joints(mechanism, values, joints, like)
}

/// A model of what a file states: bodies, `joints` with friction, rotor and spring, and the loops of the model that it is `like`.
///
/// `values`: ten inertial parameters per body. Returned with the values of the joints behind them. `Err` says which loop
/// cannot be closed.
pub(crate) fn with_joints(
    mechanism: Mechanism,
    mut values: Vec<f64>,
    joints: &[JointParameters],
    like: &RobotModel,
) -> Result<(RobotModel, Vec<f64>), String> {
    let rates = mechanism.rate_names();
    let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
    for p in joints {
        let Some(rate) = rates.iter().position(|r| *r == p.joint) else { continue };
        elements.push(Box::new(Viscous { rate }));
        elements.push(Box::new(Coulomb { rate }));
        elements.push(Box::new(RotorInertia { rate }));
        elements.push(Box::new(Spring { rate }));
        let rest = p.stiffness * p.spring_reference;
        values.extend([p.damping, p.friction_loss, p.armature, p.stiffness, rest]);
    }
    let Some(closed) = like.closed() else {
        return Ok((RobotModel::new(mechanism, elements), values));
    };
    let tree = TreeModel::new(mechanism.clone(), elements);
    let machine = closed.machine();
    let (driven, home) = (machine.driven_names(), machine.home_by_joint());
    let machine = ClosedMechanism::new(mechanism, machine.closures().to_vec(), Some(&driven), &home)
        .map_err(|e| e.to_string())?;
    Ok((ClosedModel::new(tree, machine).into(), values))
}

/// Largest difference of effort, without that of known elements, between two models of the same coordinates, each with shape and linear parameters, joint by joint relative to the largest effort
/// of the joint (of all joints, times 1e-6, if that is more: a joint may need no effort at all).
pub(crate) fn largest_difference(
    (a, a_shape, a_values): (&RobotModel, &[f64], &[f64]),
    (b, b_shape, b_values): (&RobotModel, &[f64], &[f64]),
    states: &CheckStates,
) -> f64 {
    // Motors behind springs have no place in files.
    let outputs = a.outputs().len().min(b.outputs().len());
    let (mut largest, mut difference) = (vec![0.0_f64; outputs], vec![0.0_f64; outputs]);
    let mut blocks = [a, b].map(|model| RegressorBlock::new(model.layout().clone(), states.room()));
    states.for_each_block(|motion| {
        let models = [(a, a_shape), (b, b_shape)];
        for ((model, shape), block) in models.into_iter().zip(&mut blocks) {
            with_slipping_bristles(model, motion, |motion| model.regressor(motion, shape, block));
        }
        for output in 0..outputs {
            let effort = |block: &RegressorBlock, values: &[f64]| -> Vec<f64> {
                let whole = block.effort(output, values);
                whole.iter().zip(block.offset(output)).map(|(e, known)| e - known).collect()
            };
            let (x, y) = (effort(&blocks[0], a_values), effort(&blocks[1], b_values));
            for (x, y) in x.iter().zip(&y) {
                largest[output] = largest[output].max(x.abs());
                let d = (x - y).abs();
                // A number that is not finite is a difference too.
                difference[output] = if d.is_finite() { difference[output].max(d) } else { f64::INFINITY };
            }
        }
    });
    let floor = 1e-6 * largest.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    difference.iter().zip(&largest).map(|(d, l)| d / l.max(floor)).fold(0.0, f64::max)
}

/// The motion for elements that remember, bristles slipping as Coulomb friction does: what files have a place for.
pub fn with_slipping_bristles(
    model: &RobotModel,
    motion: &MotionBlock<'_>,
    work: impl FnOnce(&MotionBlock<'_>),
) {
    let still = vec![0.0; motion.samples];
    let slipping: Vec<(&str, Vec<f64>)> = model
        .joints()
        .iter()
        .enumerate()
        .flat_map(|(rate, joint)| {
            let springs = [LuGre::BRISTLE, MaxwellSlip::SPRING].map(|name| format!("{}.{name}", joint.name));
            let signal = model.signals().iter().find(|name| springs.contains(name))?;
            Some((signal.as_str(), motion.rate(rate).iter().map(|v| sign(*v)).collect()))
        })
        .collect();
    let others = model.signals().iter().filter(|name| slipping.iter().all(|(n, _)| n != name));
    let channels: Vec<(&str, &[f64])> = motion
        .channels
        .iter()
        .copied()
        .chain(slipping.iter().map(|(name, values)| (*name, values.as_slice())))
        .chain(others.map(|name| (name.as_str(), still.as_slice())))
        .collect();
    work(&MotionBlock { channels: &channels, ..*motion });
}

/// Accepts a difference or says what is wrong.
pub(crate) fn judge(format: &'static str, difference: f64) -> Result<f64, ExportError> {
    if difference <= READ_BACK_LIMIT {
        Ok(difference)
    } else {
        Err(ExportError::ReadBack { format, difference })
    }
}
