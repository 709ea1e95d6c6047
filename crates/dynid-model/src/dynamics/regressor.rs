//! Joint torque regressor in standard parameters (spec/mechanisms.md section 5).
//!
//! The axis of every coordinate is carried outward into the axes of every body that it moves; an entry is then one
//! inner product with the body's own motion, and nothing is carried back to the base.

use super::motion::{BodyMotion, placement, step};
use super::tree::{Motion, Node, Tree};
use crate::scalar::Scalar;
use crate::spatial::Vec3;

/// Reusable memory of the outward sweep.
#[derive(Clone, Debug, Default)]
pub(crate) struct RegressorWorkspace<S> {
    motions: Vec<BodyMotion<S>>,
    /// Angular and linear part of the unit motion of a coordinate, in axes of the body.
    axes: Vec<(Vec3<S>, Vec3<S>)>,
}

impl<S: Scalar> RegressorWorkspace<S> {
    pub(crate) fn new(tree: &Tree) -> Self {
        RegressorWorkspace {
            motions: vec![BodyMotion::ground(Vec3::zero()); tree.nodes.len()],
            axes: vec![(Vec3::zero(), Vec3::zero()); tree.axis_rate.len()],
        }
    }
}

/// Computes all entries that can differ from zero and hands them to `put(slot, value)`.
///
/// `slots[k]` is the place of the first of the ten entries of carried axis `k` (row: the axis' rate, columns: the
/// body's parameters); the entry of parameter `c` of the file's frame goes to `slots[k] + c`.
#[inline(always)]
pub(crate) fn sweep<S: Scalar>(
    tree: &Tree,
    state: (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    slots: &[usize],
    work: &mut RegressorWorkspace<S>,
    mut put: impl FnMut(usize, S),
) {
    let (q, dq, ddq) = state;
    let ground = BodyMotion::ground(gravity);
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = placement(node, q);
        let parent = node.parent.map_or(&ground, |p| &work.motions[p]);
        let motion = step(node, (&rotation, origin), parent, dq, ddq);
        let tensor = TensorRows::new(motion.omega, motion.alpha);
        if let Some(p) = node.parent {
            let from = tree.nodes[p].first_axis;
            for k in 0..node.inherited {
                let (z, v) = work.axes[from + k];
                let carried = (rotation.tr_mul_vec(z), rotation.tr_mul_vec(v + z.cross(origin)));
                work.axes[node.first_axis + k] = carried;
                general_row(node, &motion, &tensor, carried, slots[node.first_axis + k], &mut put);
            }
        }
        own_rows(node, &motion, &tensor, slots, work, &mut put);
        work.motions[index] = motion;
    }
}

#[inline(always)]
fn own_rows<S: Scalar>(
    node: &Node,
    motion: &BodyMotion<S>,
    tensor: &TensorRows<S>,
    slots: &[usize],
    work: &mut RegressorWorkspace<S>,
    put: &mut impl FnMut(usize, S),
) {
    let first = node.first_axis + node.inherited;
    let axis = Vec3::constant(node.axis.0);
    match node.motion {
        Motion::RevoluteZ { sign } => {
            work.axes[first] = (axis, Vec3::zero());
            let s = S::from_f64(sign);
            let [ax, ay, _] = motion.acceleration.0;
            let row = [S::zero(), ay * s, -ax * s, S::zero()];
            let slot = slots[first];
            for (c, value) in row.into_iter().enumerate() {
                put(slot + node.columns[c], value);
            }
            for c in 0..6 {
                put(slot + node.columns[4 + c], tensor.columns[c].0[2] * s);
            }
        }
        Motion::Revolute => {
            let own = (axis, Vec3::zero());
            work.axes[first] = own;
            general_row(node, motion, tensor, own, slots[first], put);
        }
        Motion::Prismatic => {
            let own = (Vec3::zero(), axis);
            work.axes[first] = own;
            general_row(node, motion, tensor, own, slots[first], put);
        }
        Motion::Helical { pitch } => {
            let own = (axis, axis.scale(S::from_f64(pitch)));
            work.axes[first] = own;
            general_row(node, motion, tensor, own, slots[first], put);
        }
        Motion::Floating => {
            for k in 0..6 {
                let mut unit = Vec3::zero();
                unit.0[k % 3] = S::one();
                let own = if k < 3 { (Vec3::zero(), unit) } else { (unit, Vec3::zero()) };
                work.axes[first + k] = own;
                general_row(node, motion, tensor, own, slots[first + k], put);
            }
        }
    }
}

/// `[v·a | Bᵀv + a × z | Cᵀz]`.
#[inline(always)]
fn general_row<S: Scalar>(
    node: &Node,
    motion: &BodyMotion<S>,
    tensor: &TensorRows<S>,
    (z, v): (Vec3<S>, Vec3<S>),
    slot: usize,
    put: &mut impl FnMut(usize, S),
) {
    let a = motion.acceleration;
    put(slot, v.dot(a));
    let moment = motion.gradient.tr_mul_vec(v) + a.cross(z);
    for c in 0..3 {
        put(slot + node.columns[1 + c], moment.0[c]);
    }
    for c in 0..6 {
        put(slot + node.columns[4 + c], tensor.columns[c].dot(z));
    }
}

/// Columns of `C`: the moment per entry of the inertia tensor, `I α + ω × I ω = C (Ixx Ixy Ixz Iyy Iyz Izz)`.
struct TensorRows<S> {
    columns: [Vec3<S>; 6],
}

impl<S: Scalar> TensorRows<S> {
    #[inline(always)]
    fn new(omega: Vec3<S>, alpha: Vec3<S>) -> Self {
        let [x, y, z] = omega.0;
        let [a1, a2, a3] = alpha.0;
        let (xy, xz, yz) = (x * y, x * z, y * z);
        let (xx, yy, zz) = (x * x, y * y, z * z);
        TensorRows {
            columns: [
                Vec3([a1, xz, -xy]),
                Vec3([a2 - xz, a1 + yz, xx - yy]),
                Vec3([a3 + xy, zz - xx, a1 - yz]),
                Vec3([-yz, a2, xy]),
                Vec3([yy - zz, a3 - xy, a2 + xz]),
                Vec3([yz, -xz, a3]),
            ],
        }
    }
}
