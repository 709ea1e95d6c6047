//! Wrenches in the joints of the tree, linear in the inertias.

use super::dynamics::ClosedDynamics;
use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;
use super::sweep::World;
use crate::dynamics::motion::{BodyMotion, placement, step};
use crate::dynamics::regressor::{TensorRows, general_row};
use dynid_algebra::spatial::Vec3;

/// A wrench on a body in terms of standard parameters and multipliers: `wrench = W φ - C λ`, force (N) then moment about
/// the joint frame's origin (N m), axes of the joint frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ReactionRows {
    /// `W`, row-major, six rows, ten columns per body.
    pub inertial: Vec<f64>,
    /// `C`, row-major, six rows, one column per condition: the wrench that unit multipliers exert on what hangs on the joint.
    pub closures: Vec<f64>,
}

impl ClosedMechanism {
    /// Motions of all bodies at a pose, in the order of the nodes.
    pub(crate) fn body_motions(
        &self,
        pose: &PoseWorkspace,
        (dq, ddq): (&[f64], &[f64]),
        gravity: Vec3<f64>,
        out: &mut Vec<BodyMotion<f64>>,
    ) {
        let ground = BodyMotion::ground(gravity);
        out.clear();
        for node in &self.tree.nodes {
            let (rotation, origin) = placement(node, &pose.world.turns, &pose.q);
            let parent = node.parent.map_or(&ground, |p| &out[p]);
            let motion = step(node, (&rotation, origin), parent, dq, ddq);
            out.push(motion);
        }
    }

    /// Nodes that hang on the joint of a body, its own first.
    ///
    /// # Panics
    /// If there is no such body.
    pub(crate) fn hanging(&self, body: usize) -> Vec<usize> {
        let Some(at) = self.tree.nodes.iter().position(|n| n.body == body) else {
            panic!("body {body} of {}", self.tree.nodes.len())
        };
        let mut hanging = vec![at];
        for (index, node) in self.tree.nodes.iter().enumerate() {
            if node.parent.is_some_and(|p| hanging.contains(&p)) {
                hanging.push(index);
            }
        }
        hanging
    }

    /// Body of a node.
    pub(crate) fn body_of(&self, node: usize) -> usize {
        self.tree.nodes[node].body
    }

    /// One component of the wrench through the joint of `hanging[0]` that the inertia of one of the nodes needs: ten
    /// factors in the order and frame of the file.
    pub(crate) fn inertial_entries(
        &self,
        pose: &PoseWorkspace,
        motions: &[BodyMotion<f64>],
        (at, node): (usize, usize),
        component: usize,
    ) -> [f64; 10] {
        let (joint, carried) = (&pose.world.bodies[at], &pose.world.bodies[node]);
        let axis = joint.rotation.0[self.internal_axis(at, component % 3)];
        let (turn, slide) = if component < 3 {
            (Vec3::zero(), axis)
        } else {
            (axis, axis.cross(carried.origin - joint.origin))
        };
        let unit = (carried.rotation.tr_mul_vec(turn), carried.rotation.tr_mul_vec(slide));
        let motion = &motions[node];
        let tensor = TensorRows::new(motion.omega, motion.alpha);
        let mut entries = [0.0; 10];
        for (column, value) in self.tree.nodes[node].columns.iter().zip(general_row(motion, &tensor, unit)) {
            entries[*column] = value;
        }
        entries
    }

    /// One component of the wrench that unit multipliers exert on what hangs on the joint of `hanging[0]`.
    pub(crate) fn closure_entries(
        &self,
        pose: &PoseWorkspace,
        hanging: &[usize],
        component: usize,
        out: &mut [f64],
    ) {
        self.closure_entries_at(&pose.world, hanging, component, out);
    }

    pub(super) fn closure_entries_at(
        &self,
        world: &World<f64>,
        hanging: &[usize],
        component: usize,
        out: &mut [f64],
    ) {
        let joint = &world.bodies[hanging[0]];
        let axis = joint.rotation.0[self.internal_axis(hanging[0], component % 3)];
        for (condition, entry) in out.iter_mut().enumerate() {
            *entry = 0.0;
            self.rows.wrenches(world, condition, |node, wrench, side| {
                if hanging.contains(&node) {
                    let moment = wrench.moment - joint.origin.cross(wrench.force);
                    *entry += side * axis.dot(if component < 3 { wrench.force } else { moment });
                }
            });
        }
    }

    /// Internal axis of an axis of the file's frame.
    fn internal_axis(&self, node: usize, axis: usize) -> usize {
        self.tree.nodes[node].axes.iter().position(|a| *a == axis).unwrap_or(axis)
    }
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
        motion: (&[f64], &[f64]),
        gravity: Option<Vec3<f64>>,
    ) -> ReactionRows {
        let (machine, pose) = (self.machine(), &self.pose);
        let gravity = gravity.unwrap_or_else(|| machine.mechanism.gravity());
        let mut motions = Vec::new();
        machine.body_motions(pose, motion, gravity, &mut motions);
        let hanging = machine.hanging(body);
        let (columns, conditions) = (10 * machine.tree.nodes.len(), machine.rows.len());
        let mut out = ReactionRows { inertial: vec![0.0; 6 * columns], closures: vec![0.0; 6 * conditions] };
        for component in 0..6 {
            for node in &hanging {
                let entries = machine.inertial_entries(pose, &motions, (hanging[0], *node), component);
                let first = component * columns + 10 * machine.body_of(*node);
                out.inertial[first..first + 10].copy_from_slice(&entries);
            }
            let to = &mut out.closures[component * conditions..][..conditions];
            machine.closure_entries(pose, &hanging, component, to);
        }
        out
    }
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
