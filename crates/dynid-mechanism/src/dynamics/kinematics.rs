//! Forward kinematics.

use super::motion::{Turns, placement};
use super::tree::Tree;
use super::{Dynamics, DynamicsWorkspace};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Placement, Vec3};

/// Reusable memory of forward kinematics.
#[derive(Clone, Debug)]
pub(super) struct KinematicsWorkspace<S> {
    turns: Turns<S>,
    joint_q: Vec<S>,
    /// Rotation and origin of every node in base axes, in internal axes of the node.
    pub(super) frames: Vec<(Mat3<S>, Vec3<S>)>,
}

impl<S: Scalar> KinematicsWorkspace<S> {
    pub(super) fn new(tree: &Tree) -> Self {
        KinematicsWorkspace {
            turns: Turns::new(tree),
            joint_q: vec![S::zero(); tree.positions],
            frames: vec![(Mat3::zero(), Vec3::zero()); tree.nodes.len()],
        }
    }
}

impl Dynamics {
    /// Fills `work.frames`.
    #[inline(always)]
    pub(super) fn place<S: Scalar>(&self, q: &[S], work: &mut KinematicsWorkspace<S>) {
        self.expand_positions(q, &mut work.joint_q);
        work.turns.fill(&self.tree, &work.joint_q);
        for (index, node) in self.tree.nodes.iter().enumerate() {
            let (rotation, origin) = placement(node, &work.turns, &work.joint_q);
            work.frames[index] = match node.parent {
                None => (rotation, origin),
                Some(p) => {
                    let (outer, at) = &work.frames[p];
                    (outer.mul_mat(&rotation), outer.mul_vec(origin) + *at)
                }
            };
        }
    }

    /// Frames of all bodies in base axes, in file order; the axes are those of the file.
    pub fn forward_kinematics(&self, q: &[f64], work: &mut DynamicsWorkspace<f64>) -> Vec<Placement> {
        assert_eq!(q.len(), self.positions(), "length of q");
        self.place(q, &mut work.kinematics);
        let mut frames = vec![Placement::identity(); self.tree.nodes.len()];
        for (node, (rotation, translation)) in self.tree.nodes.iter().zip(&work.kinematics.frames) {
            let mut columns = [Vec3::zero(); 3];
            for k in 0..3 {
                columns[node.axes[k]] = rotation.0[k];
            }
            frames[node.body] = Placement { rotation: Mat3(columns), translation: *translation };
        }
        frames
    }
}
