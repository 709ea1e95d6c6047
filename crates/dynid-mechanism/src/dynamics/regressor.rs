//! Joint torque regressor in standard parameters.
//!
//! The axis of every coordinate is carried outward into the axes of every body that it moves; an entry is then one
//! inner product with the body's own motion, and nothing is carried back to the base.

use super::motion::{BodyMotion, Turns, placement, step};
use super::tree::{Motion, Node, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::Vec3;

/// Reusable memory of the outward sweep.
#[derive(Clone, Debug, Default)]
pub(crate) struct RegressorWorkspace<S> {
    turns: Turns<S>,
    motions: Vec<BodyMotion<S>>,
    /// Angular and linear part of the unit motion of a coordinate, in axes of the body.
    axes: Vec<(Vec3<S>, Vec3<S>)>,
}

impl<S: Scalar> RegressorWorkspace<S> {
    pub(crate) fn new(tree: &Tree) -> Self {
        RegressorWorkspace {
            turns: Turns::new(tree),
            motions: vec![BodyMotion::ground(Vec3::zero()); tree.nodes.len()],
            axes: vec![(Vec3::zero(), Vec3::zero()); tree.axis_rate.len()],
        }
    }
}

/// Computes all entries that can differ from zero and hands them to `put(slot, columns, entries)`, ten at a time.
///
/// `slots[k]` is the place of the first of the ten entries of carried axis `k` (row: the axis' rate, columns: the
/// body's parameters); entry `c` belongs to parameter `columns[c]` of the file's frame.
#[inline(always)]
pub(crate) fn sweep<S: Scalar>(
    tree: &Tree,
    state: (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    slots: &[usize],
    work: &mut RegressorWorkspace<S>,
    mut put: impl FnMut(usize, &[usize; 10], [S; 10]),
) {
    let (q, dq, ddq) = state;
    let ground = BodyMotion::ground(gravity);
    work.turns.fill(tree, q);
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = placement(node, &work.turns, q);
        let parent = node.parent.map_or(&ground, |p| &work.motions[p]);
        let motion = step(node, (&rotation, origin), parent, dq, ddq);
        let tensor = TensorRows::new(motion.omega, motion.alpha);
        let slots = &slots[node.carried()];
        let (carried_by_others, axes) = work.axes.split_at_mut(node.first_axis);
        let axes = &mut axes[..slots.len()];
        if let Some(p) = node.parent {
            let inherited = &carried_by_others[tree.nodes[p].carried()];
            for ((axis, (z, v)), slot) in axes.iter_mut().zip(inherited).zip(slots) {
                *axis = (rotation.tr_mul_vec(*z), rotation.tr_mul_vec(*v + z.cross(origin)));
                put(*slot, &node.columns, general_row(&motion, &tensor, *axis));
            }
        }
        own_rows(node, &motion, &tensor, &slots[node.inherited..], &mut axes[node.inherited..], &mut put);
        work.motions[index] = motion;
    }
}

#[inline(always)]
fn own_rows<S: Scalar>(
    node: &Node,
    motion: &BodyMotion<S>,
    tensor: &TensorRows<S>,
    slots: &[usize],
    axes: &mut [(Vec3<S>, Vec3<S>)],
    put: &mut impl FnMut(usize, &[usize; 10], [S; 10]),
) {
    let axis = Vec3::constant(node.axis.0);
    let columns = &node.columns;
    let own = match node.motion {
        Motion::RevoluteZ { sign } => {
            axes[0] = (axis, Vec3::zero());
            let s = S::from_f64(sign);
            let [ax, ay, _] = motion.acceleration.0;
            let [xx, xy, xz, yy, yz, zz] = &tensor.columns;
            let row = [
                S::zero(),
                ay * s,
                -ax * s,
                S::zero(),
                xx.0[2] * s,
                xy.0[2] * s,
                xz.0[2] * s,
                yy.0[2] * s,
                yz.0[2] * s,
                zz.0[2] * s,
            ];
            put(slots[0], columns, row);
            return;
        }
        Motion::Floating => {
            for (k, (carried, slot)) in axes.iter_mut().zip(slots).enumerate() {
                let mut unit = Vec3::zero();
                unit.0[k % 3] = S::one();
                *carried = if k < 3 { (Vec3::zero(), unit) } else { (unit, Vec3::zero()) };
                put(*slot, columns, general_row(motion, tensor, *carried));
            }
            return;
        }
        Motion::Revolute | Motion::Prismatic | Motion::Helical { .. } => own_axis(node),
    };
    axes[0] = own;
    put(slots[0], columns, general_row(motion, tensor, own));
}

/// Angular and linear part of the unit motion of a joint with one rate, in axes of its body.
#[inline(always)]
pub(super) fn own_axis<S: Scalar>(node: &Node) -> (Vec3<S>, Vec3<S>) {
    let axis = Vec3::constant(node.axis.0);
    match node.motion {
        Motion::RevoluteZ { .. } | Motion::Revolute => (axis, Vec3::zero()),
        Motion::Prismatic => (Vec3::zero(), axis),
        Motion::Helical { pitch } => (axis, axis.scale(S::from_f64(pitch))),
        Motion::Floating => unreachable!("a floating joint has six"),
    }
}

/// `[v·a | Bᵀv + a × z | Cᵀz]`.
#[inline(always)]
pub fn general_row<S: Scalar>(
    motion: &BodyMotion<S>,
    tensor: &TensorRows<S>,
    (z, v): (Vec3<S>, Vec3<S>),
) -> [S; 10] {
    let a = motion.acceleration;
    let [hx, hy, hz] = (motion.gradient.tr_mul_vec(v) + a.cross(z)).0;
    let [xx, xy, xz, yy, yz, zz] = &tensor.columns;
    [v.dot(a), hx, hy, hz, xx.dot(z), xy.dot(z), xz.dot(z), yy.dot(z), yz.dot(z), zz.dot(z)]
}

/// Columns of `C`: the moment per entry of the inertia tensor, `I α + ω × I ω = C (Ixx Ixy Ixz Iyy Iyz Izz)`.
pub struct TensorRows<S> {
    pub(super) columns: [Vec3<S>; 6],
}

impl<S: Scalar> TensorRows<S> {
    #[inline(always)]
    /// Rows at an angular velocity and acceleration, in axes of the body.
    pub fn new(omega: Vec3<S>, alpha: Vec3<S>) -> Self {
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
