//! Path constraints of mechanisms with loops: those of all joints, and the distance from singular poses.

use std::sync::Arc;

use dynid_model::closed::{ClosedMechanism, PoseWorkspace};
use dynid_model::{ClosedModel, JointMotion, MotionAdjoint, MotionBlock};

use super::gathered::Gathered;
use super::{ConstraintError, ConstraintKind, ConstraintRow, PathConstraint, by_sample, positive};

/// Rows whose gradients run side by side.
const BATCH: usize = 256;
/// Step of the differences behind the gradient of the distance from singular poses, m (or rad times the mechanism's length).
const STEP: f64 = 1e-5;

/// Gradients of rows by the independent coordinates: `fill(places, joints, weights)` writes their derivatives by the motion of all joints,
/// sample `k` of which is that of the wanted row `places[k]`.
pub(super) fn carried(
    model: &ClosedModel,
    motion: &MotionBlock<'_>,
    wanted: &[(usize, usize)],
    mut fill: impl FnMut(&[usize], &JointMotion, &mut MotionAdjoint),
    out: &mut [f64],
) {
    let d = model.machine().mobility();
    let rates = model.machine().mechanism().rates();
    assert_eq!(out.len(), 3 * d * wanted.len(), "length of the gradients");
    // Poses are followed from one to the next: those of one sample side by side.
    for places in by_sample(wanted).chunks(BATCH) {
        let n = places.len();
        let mut weights = MotionAdjoint::new(rates, rates, n);
        let mut adjoint = MotionAdjoint::new(d, d, n);
        Gathered::new(motion, places.iter().map(|p| wanted[*p].1)).with_block(motion, |block| {
            fill(places, &model.joint_motion(block), &mut weights);
            model.joint_motion_adjoint(block, &weights, &mut adjoint);
        });
        for (kind, from) in [&adjoint.q, &adjoint.dq, &adjoint.ddq].into_iter().enumerate() {
            for (c, from) in from.chunks_exact(n).enumerate() {
                for (place, value) in places.iter().zip(from) {
                    out[3 * d * place + d * kind + c] = *value;
                }
            }
        }
    }
}

/// A path constraint of all joints of a mechanism with loops, along a motion of its independent coordinates.
///
/// Where there is no pose, values are not numbers.
pub struct OfAllJoints {
    model: Arc<ClosedModel>,
    own: Box<dyn PathConstraint>,
}

impl OfAllJoints {
    /// `own`: a constraint on the motion of all joints of the tree.
    ///
    /// # Errors
    /// [`ConstraintError::Floating`].
    pub fn new(model: Arc<ClosedModel>, own: Box<dyn PathConstraint>) -> Result<Self, ConstraintError> {
        let tree = model.machine().mechanism();
        super::fixed_base(tree.positions(), tree.rates())?;
        Ok(OfAllJoints { model, own })
    }
}

impl PathConstraint for OfAllJoints {
    fn rows(&self) -> &[ConstraintRow] {
        self.own.rows()
    }

    fn values(&self, motion: &MotionBlock<'_>, stride: usize, values: &mut [f64]) {
        let joints = self.model.joint_motion(motion);
        self.own.values(&joints.block(), stride, values);
        let n = joints.samples;
        // Distances may make a number of what is none.
        for s in (0..n).filter(|s| joints.q.iter().skip(*s).step_by(n).any(|q| q.is_nan())) {
            (0..self.own.rows().len()).for_each(|row| values[row * stride + s] = f64::NAN);
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let rates = self.model.machine().mechanism().rates();
        let mut of_joints = Vec::new();
        let fill = |places: &[usize], joints: &JointMotion, weights: &mut MotionAdjoint| {
            let own: Vec<(usize, usize)> =
                places.iter().enumerate().map(|(k, place)| (wanted[*place].0, k)).collect();
            of_joints.resize(3 * rates * own.len(), 0.0);
            self.own.gradients(&joints.block(), &own, &mut of_joints);
            let n = own.len();
            for (k, from) in of_joints.chunks_exact(3 * rates).enumerate() {
                let to = [&mut weights.q, &mut weights.dq, &mut weights.ddq];
                for (to, from) in to.into_iter().zip(from.chunks_exact(rates)) {
                    from.iter().enumerate().for_each(|(rate, x)| to[rate * n + k] = *x);
                }
            }
        };
        carried(&self.model, motion, wanted, fill, out);
    }
}

/// Distance of a mechanism with loops from singular poses: one row `measure / least ≥ 1`, with the measure
/// `σ_min/σ_max` of the Jacobian of the dependent coordinates ([`Singularity`](dynid_model::closed::Singularity)).
///
/// Where there is no pose, the value is not a number. Gradients are central differences over 10 µm.
#[derive(Debug, Clone)]
pub struct SingularityLimit {
    model: Arc<ClosedModel>,
    rows: [ConstraintRow; 1],
}

impl SingularityLimit {
    /// `least`: least measure.
    ///
    /// # Errors
    /// [`ConstraintError::Number`] unless it is positive.
    pub fn new(model: Arc<ClosedModel>, least: f64) -> Result<Self, ConstraintError> {
        let subject = model.machine().mechanism().name().to_owned();
        positive("least measure", &subject, least)?;
        let kind = ConstraintKind::Singularity;
        let rows =
            [ConstraintRow { kind, subject, lower: 1.0, upper: f64::INFINITY, scale: least, unit: "" }];
        Ok(SingularityLimit { model, rows })
    }

    fn machine(&self) -> &ClosedMechanism {
        self.model.machine()
    }

    /// The measure over its least value at the pose of a workspace.
    fn value(&self, work: &PoseWorkspace) -> f64 {
        self.machine().singularity(work).measure / self.rows[0].scale
    }
}

impl PathConstraint for SingularityLimit {
    fn rows(&self) -> &[ConstraintRow] {
        &self.rows
    }

    fn values(&self, motion: &MotionBlock<'_>, _: usize, values: &mut [f64]) {
        let joints = self.model.joint_motion(motion);
        let (n, mut work) = (joints.samples, self.machine().workspace());
        for (s, value) in values.iter_mut().enumerate().take(n) {
            let q: Vec<f64> = joints.q.iter().skip(s).step_by(n).copied().collect();
            let is_pose = self.machine().take(&mut work, &q).is_ok();
            *value = if is_pose { self.value(&work) } else { f64::NAN };
        }
    }

    fn gradients(&self, motion: &MotionBlock<'_>, wanted: &[(usize, usize)], out: &mut [f64]) {
        let d = self.machine().mobility();
        assert_eq!(out.len(), 3 * d * wanted.len(), "length of the gradients");
        out.fill(0.0);
        let gathered = Gathered::new(motion, wanted.iter().map(|(_, sample)| *sample));
        let mut joints = None;
        gathered.with_block(motion, |block| joints = Some(self.model.joint_motion(block)));
        let Some(joints) = joints else { return };
        let (n, mut work) = (joints.samples, self.machine().workspace());
        let independent = self.machine().independent();
        let places: Vec<usize> = independent.iter().map(|rate| self.machine().position_of(*rate)).collect();
        for (k, out) in out.chunks_exact_mut((3 * d).max(1)).enumerate() {
            let q: Vec<f64> = joints.q.iter().skip(k).step_by(n).copied().collect();
            let at: Vec<f64> = places.iter().map(|place| q[*place]).collect();
            for (c, to) in out[..d].iter_mut().enumerate() {
                let h = STEP / self.machine().rate_scales()[independent[c]];
                let mut beside = |by: f64| {
                    let mut next = at.clone();
                    next[c] += by;
                    self.machine().take(&mut work, &q).ok()?;
                    self.machine().reach(&mut work, &next).ok()?;
                    Some(self.value(&work))
                };
                *to = match (beside(h), beside(-h)) {
                    (Some(after), Some(before)) => (after - before) / (2.0 * h),
                    _ => f64::NAN,
                };
            }
        }
    }
}
