//! Wrenches in the joints of the tree, linear in the inertias (spec/mechanisms.md sections 6 and 12).

use super::dynamics::ClosedDynamics;
use crate::dynamics::motion::{BodyMotion, Turns, placement, step};
use crate::dynamics::regressor::{TensorRows, general_row};
use crate::dynamics::tree::Node;
use crate::spatial::Vec3;

/// A wrench on a body in terms of standard parameters and multipliers: `wrench = W φ - C λ`, force (N) then moment about
/// the joint frame's origin (N m), axes of the joint frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReactionRows {
    /// `W`, row-major, six rows, ten columns per body.
    pub inertial: Vec<f64>,
    /// `C`, row-major, six rows, one column per condition: the wrench that unit multipliers exert on what hangs on the joint.
    pub closures: Vec<f64>,
}

impl ClosedDynamics {
    /// Terms of the wrench that the parent exerts on a body through its joint, at the pose.
    ///
    /// `dq`, `ddq`: of all coordinates; `gravity`: base axes, m/s², `None`: the mechanism's.
    ///
    /// # Panics
    /// If a slice has the wrong length or there is no such body.
    pub fn reaction_rows(
        &self,
        body: usize,
        (dq, ddq): (&[f64], &[f64]),
        gravity: Option<Vec3<f64>>,
    ) -> ReactionRows {
        let (machine, pose) = (self.machine(), &self.pose);
        let tree = &machine.tree;
        let Some(at) = tree.nodes.iter().position(|n| n.body == body) else {
            panic!("body {body} of {}", tree.nodes.len())
        };
        let gravity = gravity.unwrap_or_else(|| machine.mechanism.gravity());
        let mut turns = Turns::new(tree);
        turns.fill(tree, &pose.q);
        let ground = BodyMotion::ground(gravity);
        let mut motions: Vec<BodyMotion<f64>> = Vec::with_capacity(tree.nodes.len());
        let mut hangs: Vec<bool> = Vec::with_capacity(tree.nodes.len());
        for (index, node) in tree.nodes.iter().enumerate() {
            let (rotation, origin) = placement(node, &turns, &pose.q);
            let parent = node.parent.map_or(&ground, |p| &motions[p]);
            motions.push(step(node, (&rotation, origin), parent, dq, ddq));
            hangs.push(index == at || node.parent.is_some_and(|p| hangs[p]));
        }
        let (columns, conditions) = (10 * tree.nodes.len(), machine.rows.len());
        let mut out = ReactionRows { inertial: vec![0.0; 6 * columns], closures: vec![0.0; 6 * conditions] };
        let joint = &pose.world.bodies[at];
        let axes = file_axes(&tree.nodes[at]);
        for (index, node) in tree.nodes.iter().enumerate().filter(|(k, _)| hangs[*k]) {
            let carried = &pose.world.bodies[index];
            let motion = &motions[index];
            let tensor = TensorRows::new(motion.omega, motion.alpha);
            for row in 0..6 {
                let axis = joint.rotation.0[axes[row % 3]];
                let (turn, slide) = if row < 3 {
                    (Vec3::zero(), axis)
                } else {
                    (axis, axis.cross(carried.origin - joint.origin))
                };
                let unit = (carried.rotation.tr_mul_vec(turn), carried.rotation.tr_mul_vec(slide));
                let to = &mut out.inertial[row * columns + 10 * node.body..][..10];
                for (column, value) in node.columns.iter().zip(general_row(motion, &tensor, unit)) {
                    to[*column] = value;
                }
            }
        }
        for condition in 0..conditions {
            machine.rows.wrenches(&pose.world, condition, |node, wrench, side| {
                if !hangs[node] {
                    return;
                }
                let moment = wrench.moment - joint.origin.cross(wrench.force);
                for row in 0..6 {
                    let axis = joint.rotation.0[axes[row % 3]];
                    let part = if row < 3 { axis.dot(wrench.force) } else { axis.dot(moment) };
                    out.closures[row * conditions + condition] += side * part;
                }
            });
        }
        out
    }
}

/// Axis of the file's frame → internal axis.
fn file_axes(node: &Node) -> [usize; 3] {
    let mut out = [0; 3];
    for (internal, file) in node.axes.iter().enumerate() {
        out[*file] = internal;
    }
    out
}

impl ReactionRows {
    /// The wrench for given inertias and multipliers.
    pub fn wrench(&self, inertias: &[f64], multipliers: &[f64]) -> [f64; 6] {
        let product = |rows: &[f64], x: &[f64], k: usize| -> f64 {
            rows[k * x.len()..(k + 1) * x.len()].iter().zip(x).map(|(a, b)| a * b).sum()
        };
        std::array::from_fn(|k| {
            product(&self.inertial, inertias, k) - product(&self.closures, multipliers, k)
        })
    }

    /// One row of the wrench as a regressor in the inertias, with the regressor `Λ` of the multipliers
    /// ([`super::ClosedRegressor::multipliers`]): `W_k - C_k Λ`.
    pub fn regressor_row(&self, row: usize, multipliers: &[f64]) -> Vec<f64> {
        let columns = self.inertial.len() / 6;
        let conditions = self.closures.len() / 6;
        let mut out = self.inertial[row * columns..(row + 1) * columns].to_vec();
        for (c, rows) in self.closures[row * conditions..]
            .iter()
            .zip(multipliers.chunks_exact(columns.max(1)))
            .take(conditions)
        {
            if *c != 0.0 {
                out.iter_mut().zip(rows).for_each(|(o, l)| *o -= c * l);
            }
        }
        out
    }
}
