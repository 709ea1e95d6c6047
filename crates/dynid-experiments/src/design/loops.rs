//! Designs for mechanisms with loops: coordinates are the drives, all other joints follow.

use std::sync::Arc;

use dynid_excitation::MotionLimits;
use dynid_excitation::constraint::{
    JointLimits, JointQuantity, JointRange, PathConstraint, SingularityLimit,
};
use dynid_identify::Error;
use dynid_identify::robot::{Robot, refuse_internal_load};
use dynid_model::closed::ClosedMechanism;
use dynid_model::{ClosedModel, JointKind, MotionBlock, TreeModel};

use super::DesignError;
use super::config::DesignConfig;

/// Distance from singular poses that is kept where none is stated, as a share of that at home.
const SINGULARITY: f64 = 0.3;
/// Range of a joint that slides and that nobody limits, m: no machine is larger.
const REACH: f64 = 1e3;

/// Poses of a robot with loops; `None` for a tree.
///
/// # Errors
/// [`Error::Unsupported`] for drives that are not the independent coordinates, one for one.
pub(super) fn poses(robot: &Robot) -> Result<Option<Arc<ClosedModel>>, Error> {
    refuse_internal_load(robot, "designed for by this command")?;
    let Some(machine) = &robot.closed else { return Ok(None) };
    if !machine.drives_are_independent() {
        return Err(Error::Unsupported(
            "a design is a motion of the drives, and the drives of this mechanism do not tell its pose"
                .to_owned(),
        ));
    }
    let tree = machine.mechanism();
    if tree.positions() != tree.rates() {
        return Err(Error::Unsupported(
            "a design for a mechanism with loops and a joint that floats: cut the loops elsewhere".to_owned(),
        ));
    }
    Ok(Some(Arc::new(ClosedModel::new(TreeModel::new(tree.clone(), Vec::new()), machine.clone()))))
}

/// Rates of the tree that the coordinates of a design are.
pub(super) fn coordinates(robot: &Robot) -> Vec<usize> {
    match &robot.closed {
        Some(machine) => machine.independent().to_vec(),
        None => (0..robot.mechanism.rates()).collect(),
    }
}

/// Ranges of the positions of all joints of the tree: of drives their limits, of others what the file states, else half a turn to both
/// sides, or no limit.
pub(super) fn ranges(robot: &Robot, limits: &[MotionLimits]) -> Vec<(f64, f64)> {
    let own = coordinates(robot);
    let owners = robot.mechanism.rate_bodies();
    let of = |rate: usize| {
        if let Some(k) = own.iter().position(|c| *c == rate) {
            return limits[k].position;
        }
        let joint = &robot.mechanism.bodies()[owners[rate]].joint;
        let stated = joint.limits.position.filter(|(low, high)| low < high);
        let wide = if joint.kind == JointKind::Prismatic { REACH } else { std::f64::consts::PI };
        stated.unwrap_or((-wide, wide))
    };
    (0..robot.mechanism.rates()).map(of).collect()
}

/// Limits of joints that follow from the drives, and the distance from singular poses.
pub(super) fn constraints(
    robot: &Robot,
    config: &DesignConfig,
    poses: &Arc<ClosedModel>,
) -> Result<Vec<Box<dyn PathConstraint>>, Error> {
    let machine = poses.machine();
    let least = config.limits.singularity.unwrap_or(SINGULARITY) * at_home(machine);
    let mut out: Vec<Box<dyn PathConstraint>> =
        vec![Box::new(SingularityLimit::new(poses.clone(), least).map_err(DesignError::from)?)];
    let limits = followers(robot, machine, config.limits.share);
    if !limits.is_empty() {
        out.push(Box::new(JointLimits::new(poses.clone(), limits).map_err(DesignError::from)?));
    }
    Ok(out)
}

/// Measure of the home pose.
fn at_home(machine: &ClosedMechanism) -> f64 {
    machine.singularity(&machine.workspace()).measure
}

/// Stated limits of joints that are not drives.
fn followers(robot: &Robot, machine: &ClosedMechanism, share: f64) -> Vec<JointRange> {
    let tree = machine.mechanism();
    let (owners, names) = (tree.rate_bodies(), tree.rate_names());
    let mut out = Vec::new();
    for rate in machine.dependent() {
        let joint = &robot.mechanism.bodies()[owners[*rate]].joint;
        let slides = joint.kind == JointKind::Prismatic;
        let mut add = |quantity, (lower, upper): (f64, f64), units: [&'static str; 2]| {
            let (middle, half) = (0.5 * (lower + upper), 0.5 * share * (upper - lower));
            out.push(JointRange {
                subject: names[*rate].clone(),
                quantity,
                terms: vec![(*rate, 1.0)],
                lower: middle - half,
                upper: middle + half,
                scale: half,
                unit: units[usize::from(slides)],
            });
        };
        let finite = |(low, high): &(f64, f64)| low < high && low.is_finite() && high.is_finite();
        if let Some(range) = joint.limits.position.filter(finite) {
            add(JointQuantity::Position, range, ["rad", "m"]);
        }
        if let Some(speed) = joint.limits.velocity.filter(|v| *v > 0.0 && v.is_finite()) {
            add(JointQuantity::Rate, (-speed, speed), ["rad/s", "m/s"]);
        }
    }
    out
}

/// Hands on a motion of the drives as one of all joints.
pub(super) fn with_all_joints<T>(
    poses: Option<&Arc<ClosedModel>>,
    motion: &MotionBlock<'_>,
    work: impl FnOnce(&MotionBlock<'_>) -> T,
) -> T {
    match poses {
        Some(poses) => work(&poses.joint_motion(motion).block()),
        None => work(motion),
    }
}
