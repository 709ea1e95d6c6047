//! Limits of joints that follow from other coordinates.

use std::sync::Arc;

use dynid_model::{ClosedModel, JointMotion, MotionAdjoint, MotionBlock};

use super::closed::carried;
use super::{ConstraintError, ConstraintKind, ConstraintRow, PathConstraint, finite, positive};

/// What of joints is limited.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointQuantity {
    /// Position, rad or m.
    Position,
    /// Rate.
    Rate,
    /// Acceleration.
    Acceleration,
}

/// A range of a combination of joints: `lower ≤ Σ factor · quantity ≤ upper`.
#[derive(Debug, Clone, PartialEq)]
pub struct JointRange {
    /// What it is, in words.
    pub subject: String,
    /// Quantity.
    pub quantity: JointQuantity,
    /// Rates of the tree with their factors: one joint, or a difference of two.
    pub terms: Vec<(usize, f64)>,
    /// Least value; may be `-∞`.
    pub lower: f64,
    /// Largest value; may be `+∞`.
    pub upper: f64,
    /// What counts as one in searches, in [`JointRange::unit`].
    pub scale: f64,
    /// Unit.
    pub unit: &'static str,
}

/// Ranges of joints of a mechanism with loops, whichever of its joints a motion is told by.
///
/// Where a pose is out of reach, values are not numbers; searches take that for outside.
#[derive(Debug, Clone)]
pub struct JointLimits {
    model: Arc<ClosedModel>,
    ranges: Vec<JointRange>,
    rows: Vec<ConstraintRow>,
}

impl JointLimits {
    /// Fails if a joint floats, a rate does not exist, a factor is not finite, a scale not positive or a bound not a number.
    pub fn new(model: Arc<ClosedModel>, ranges: Vec<JointRange>) -> Result<Self, ConstraintError> {
        let tree = model.machine().mechanism();
        super::fixed_base(tree.positions(), tree.rates())?;
        for range in &ranges {
            positive("scale", &range.subject, range.scale)?;
            for (rate, factor) in &range.terms {
                finite("factor", &range.subject, &[*factor])?;
                if *rate >= tree.rates() {
                    let (what, expected) = ("rates", tree.rates());
                    return Err(ConstraintError::Length { what, found: rate + 1, expected });
                }
            }
            if range.lower.is_nan() || range.upper.is_nan() || range.lower > range.upper {
                return Err(ConstraintError::Number {
                    what: "lower bound",
                    subject: range.subject.clone(),
                    found: range.lower,
                    expected: "a number, at most the upper bound",
                });
            }
        }
        let row = |range: &JointRange| ConstraintRow {
            kind: match range.quantity {
                JointQuantity::Position => ConstraintKind::JointPosition,
                JointQuantity::Rate => ConstraintKind::JointRate,
                JointQuantity::Acceleration => ConstraintKind::JointAcceleration,
            },
            subject: range.subject.clone(),
            lower: range.lower / range.scale,
            upper: range.upper / range.scale,
            scale: range.scale,
            unit: range.unit,
        };
        Ok(JointLimits { rows: ranges.iter().map(row).collect(), ranges, model })
    }
}

impl PathConstraint for JointLimits {
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        let n = motion.samples;
        let joints = self.model.joint_motion(motion);
        for (r, range) in self.ranges.iter().enumerate() {
            let to = &mut values[r * stride..][..n];
            to.fill(0.0);
            let from = match range.quantity {
                JointQuantity::Position => &joints.q,
                JointQuantity::Rate => &joints.dq,
                JointQuantity::Acceleration => &joints.ddq,
            };
            for (rate, factor) in &range.terms {
                let factor = factor / range.scale;
                to.iter_mut().zip(&from[rate * n..][..n]).for_each(|(t, x)| *t += factor * x);
            }
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let fill = |places: &[usize], joints: &JointMotion, weights: &mut MotionAdjoint| {
            for (k, place) in places.iter().enumerate() {
                let range = &self.ranges[wanted[*place].0];
                let to = match range.quantity {
                    JointQuantity::Position => &mut weights.q,
                    JointQuantity::Rate => &mut weights.dq,
                    JointQuantity::Acceleration => &mut weights.ddq,
                };
                for (rate, factor) in &range.terms {
                    to[rate * joints.samples + k] += factor / range.scale;
                }
            }
        };
        carried(&self.model, motion, wanted, fill, out);
    }
}
