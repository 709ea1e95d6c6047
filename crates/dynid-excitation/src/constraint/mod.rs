//! Path constraints: functions of the motion at one instant that must stay within bounds along a whole trajectory.
//!
//! Limits of position, rate, acceleration and jerk are linear in the trajectory's unknowns and are not kept here. Efforts
//! and distances are, each normalised to the order of one (spec/excitation.md section 5.1). None of them is band-limited:
//! bounds that hold on a grid may break between its samples.

use dynid_model::MotionBlock;

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
    /// Unit of the value times `scale`: `N m`, `N` or `m`.
    pub unit: &'static str,
}

/// Functions of the motion at one instant, normalised to the order of one.
///
/// Values and gradients are finite at every pose, allowed or not: searches start far outside.
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
    /// As [`PathConstraint::values`]; if a row or sample does not exist, or a joint floats.
    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]);
}
