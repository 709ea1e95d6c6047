//! Path constraints: functions of the motion at one instant that must stay within bounds along a whole trajectory.
//!
//! Limits of position, rate, acceleration and jerk are linear in the trajectory's unknowns and are not kept here. Efforts
//! and distances are, each normalised to the order of one. None of them is band-limited:
//! bounds that hold on a grid may break between its samples.

mod capsule;
mod cartesian;
mod clearance;
mod closed;
mod effort;
mod gathered;
mod joints;
mod screening;
mod segment;

pub use capsule::{Capsule, CapsulePairs, Capsules};
pub use cartesian::Plane;
pub use cartesian::{CartesianLimits, FramePoint, Region};
pub use closed::{OfAllJoints, SingularityLimit};
pub use effort::EffortLimits;
pub use joints::{JointLimits, JointQuantity, JointRange};
pub use screening::{PlaneScreening, Screening, mean_place, screen};

use dynid_model::{BodyPoint, Dynamics, MechanismError, MotionBlock, Vec3};
use thiserror::Error;

/// Distance that counts as one in normalised rows, m.
pub const DISTANCE_SCALE: f64 = 0.5;

/// Why a constraint cannot be stated.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum ConstraintError {
    /// A frame does not exist.
    #[error(transparent)]
    Frame(#[from] MechanismError),
    /// A number that must be finite, or positive, is not.
    #[error("{what} of `{subject}` is {found}, expected {expected}")]
    Number {
        /// Name of the number.
        what: &'static str,
        /// Output, frame or region.
        subject: String,
        /// What was found.
        found: f64,
        /// What it should be.
        expected: &'static str,
    },
    /// A list has the wrong length.
    #[error("{found} {what}, expected {expected}")]
    Length {
        /// Of what.
        what: &'static str,
        /// Length found.
        found: usize,
        /// Length expected.
        expected: usize,
    },
    /// A pair names a capsule that does not exist, or one capsule twice.
    #[error("pair ({}, {}) of {capsules} capsules", pair.0, pair.1)]
    Pair {
        /// The pair.
        pair: (usize, usize),
        /// Number of capsules.
        capsules: usize,
    },
    /// The derivative with respect to the orientation of a floating joint is not offered.
    #[error("a joint floats: path constraints are for robots on a fixed base")]
    Floating,
}

fn finite(what: &'static str, subject: &str, numbers: &[f64]) -> Result<(), ConstraintError> {
    match numbers.iter().find(|x| !x.is_finite()) {
        None => Ok(()),
        Some(x) => Err(ConstraintError::Number {
            what,
            subject: subject.into(),
            found: *x,
            expected: "a finite number",
        }),
    }
}

fn positive(what: &'static str, subject: &str, number: f64) -> Result<(), ConstraintError> {
    if number > 0.0 && number.is_finite() {
        return Ok(());
    }
    let expected = "a positive number";
    Err(ConstraintError::Number { what, subject: subject.into(), found: number, expected })
}

/// Floating joints have more position entries than rates.
fn fixed_base(positions: usize, rates: usize) -> Result<(), ConstraintError> {
    if positions == rates { Ok(()) } else { Err(ConstraintError::Floating) }
}

/// Positions of one sample.
fn pose(motion: &MotionBlock<'_>, sample: usize, q: &mut [f64]) {
    for (c, q) in q.iter_mut().enumerate() {
        *q = motion.q[c * motion.stride + sample];
    }
}

/// Calls `work(place, row, positions, jacobians)` for every wanted row, with points and their Jacobians (row-major, three
/// rows a point) at the pose of its sample; each pose is computed once.
fn at_poses(
    dynamics: &Dynamics,
    points: &[BodyPoint],
    motion: &MotionBlock<'_>,
    wanted: &[(usize, usize)],
    mut work: impl FnMut(usize, usize, &[Vec3<f64>], &[f64]),
) {
    let n = dynamics.rates();
    let mut memory = dynamics.workspace();
    let mut q = vec![0.0; n];
    let mut positions = vec![Vec3::zero(); points.len()];
    let mut jacobians = vec![0.0; 3 * n * points.len()];
    let mut placed = None;
    for place in by_sample(wanted) {
        let (row, sample) = wanted[place];
        if placed != Some(sample) {
            pose(motion, sample, &mut q);
            dynamics.point_jacobians(&q, points, &mut memory, &mut positions, &mut jacobians);
            placed = Some(sample);
        }
        work(place, row, &positions, &jacobians);
    }
}

/// Indices of wanted rows, those of one sample next to each other.
fn by_sample(wanted: &[(usize, usize)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by_key(|k| wanted[*k].1);
    order
}

/// What a path constraint limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ConstraintKind {
    /// Effort of an output.
    Effort,
    /// Distance of a point from a plane, positive on the allowed side.
    HalfSpace,
    /// Distance of a point from a face of a box, positive inside.
    Box,
    /// Distance of a point from an upright cylinder, positive outside.
    Cylinder,
    /// How far a point is outside an upright column or above it.
    Column,
    /// Distance between two capsules on the robot.
    Capsule,
    /// Distance between two links of the robot.
    OwnLinks,
    /// Height of a link above the floor.
    Floor,
    /// Distance of a link from the plane that the robot is mounted on.
    Mounting,
    /// Position of joints that follow from the coordinates.
    JointPosition,
    /// Rate of such joints.
    JointRate,
    /// Acceleration of such joints.
    JointAcceleration,
    /// Distance of a mechanism with loops from singular poses.
    Singularity,
}

/// One row of a path constraint.
#[derive(Debug, Clone, PartialEq)]
pub struct ConstraintRow {
    /// What it limits.
    pub kind: ConstraintKind,
    /// The output, frame or pair of frames concerned, by name.
    pub subject: String,
    /// Smallest allowed normalised value; may be `-∞`.
    pub lower: f64,
    /// Largest allowed normalised value; may be `+∞`.
    pub upper: f64,
    /// Factor from the normalised value to [`ConstraintRow::unit`].
    pub scale: f64,
    /// Unit of the value times `scale`: `N m`, `N`, `m`, of joints also `rad` and their derivatives; empty for a ratio.
    pub unit: &'static str,
}

/// Functions of the motion at one instant, normalised to the order of one.
///
/// Values and gradients are finite at every pose, allowed or not: searches start far outside. Where a mechanism with loops
/// has no pose, they are not numbers, which counts as outside.
pub trait PathConstraint: Send + Sync {
    /// Rows in the order of their values.
    fn rows(&self) -> &[ConstraintRow];
    /// Values of all rows and samples: row `r`, sample `s` at `values[r * stride + s]`.
    ///
    /// # Panics
    /// If the motion has other dimensions than the constraint's robot, or `values` is too short.
    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]);
    /// Derivatives of each wanted `(row, sample)` with respect to `[q; dq; ddq]` of that sample, in the order asked:
    /// `3 n` numbers each, `n` the number of rates; `out` has room for exactly these.
    ///
    /// # Panics
    /// Panics as [`PathConstraint::values`] does; if a row or sample does not exist, or a joint floats.
    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]);
}
