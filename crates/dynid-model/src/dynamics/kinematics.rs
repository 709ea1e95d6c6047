//! Forward kinematics.

use super::motion::{Turns, placement};
use super::{Dynamics, DynamicsWorkspace, State};
use crate::spatial::{Mat3, Placement, Vec3};

impl Dynamics {
    /// Frames of all bodies in base axes, in file order; the axes are those of the file.
    pub fn forward_kinematics(&self, q: &[f64], work: &mut DynamicsWorkspace<f64>) -> Vec<Placement> {
        assert_eq!(q.len(), self.positions(), "length of q");
        let joint_q;
        let q = if self.follows.is_some() {
            let zero = vec![0.0; self.rates()];
            let state = State { q, dq: &zero, ddq: &zero, gravity: None };
            self.expand(&state, &mut work.joint_state);
            joint_q = work.joint_state[0].clone();
            &joint_q
        } else {
            q
        };
        let mut turns = Turns::new(&self.tree);
        turns.fill(&self.tree, q);
        let mut internal: Vec<Placement> = Vec::with_capacity(self.tree.nodes.len());
        let mut frames = vec![Placement::identity(); self.tree.nodes.len()];
        for node in &self.tree.nodes {
            let (rotation, translation) = placement(node, &turns, q);
            let local = Placement { rotation, translation };
            let global = node.parent.map_or(local, |p| internal[p].then(&local));
            let mut columns = [Vec3::zero(); 3];
            for k in 0..3 {
                columns[node.axes[k]] = global.rotation.0[k];
            }
            frames[node.body] = Placement { rotation: Mat3(columns), translation: global.translation };
            internal.push(global);
        }
        frames
    }
}
