//! Inverse dynamics: efforts from motion (recursive Newton-Euler).

use super::motion::{BodyMotion, Turns, placement, step};
use super::tree::{Motion, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// Reusable memory of the two sweeps.
#[derive(Clone, Debug, Default)]
pub(crate) struct InverseDynamicsWorkspace<S> {
    turns: Turns<S>,
    /// Standard parameters of every node in internal axes.
    inertias: Vec<[S; 10]>,
    motions: Vec<BodyMotion<S>>,
    placements: Vec<(Mat3<S>, Vec3<S>)>,
    forces: Vec<(Vec3<S>, Vec3<S>)>,
}

impl<S: Scalar> InverseDynamicsWorkspace<S> {
    pub(crate) fn new(tree: &Tree) -> Self {
        InverseDynamicsWorkspace {
            turns: Turns::new(tree),
            inertias: vec![[S::zero(); 10]; tree.nodes.len()],
            motions: vec![BodyMotion::ground(Vec3::zero()); tree.nodes.len()],
            placements: vec![(Mat3::zero(), Vec3::zero()); tree.nodes.len()],
            forces: vec![(Vec3::zero(), Vec3::zero()); tree.nodes.len()],
        }
    }

    /// Takes the inertias of the sweeps to come: ten numbers per body in file order and file frames.
    #[inline(always)]
    pub(crate) fn load_inertias<T: Copy>(&mut self, tree: &Tree, inertias: &[T], number: impl Fn(T) -> S) {
        let (bodies, _) = inertias.as_chunks::<10>();
        for (node, internal) in tree.nodes.iter().zip(&mut self.inertias) {
            let file = &bodies[node.body];
            for (to, column) in internal.iter_mut().zip(&node.columns) {
                *to = number(file[*column]);
            }
        }
    }

    /// Force and moment about the frame origin that the joint of node `k` transmits, in axes of the body.
    pub(crate) fn wrench(&self, node: usize) -> (Vec3<S>, Vec3<S>) {
        self.forces[node]
    }
}

/// Writes the effort of every joint rate for the inertias loaded into the workspace.
#[inline(always)]
pub(crate) fn sweep<S: Scalar>(
    tree: &Tree,
    state: (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    work: &mut InverseDynamicsWorkspace<S>,
    effort: &mut [S],
) {
    let (q, dq, ddq) = state;
    let ground = BodyMotion::ground(gravity);
    work.turns.fill(tree, q);
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = placement(node, &work.turns, q);
        let parent = node.parent.map_or(&ground, |p| &work.motions[p]);
        let motion = step(node, (&rotation, origin), parent, dq, ddq);
        let [mass, hx, hy, hz, xx, xy, xz, yy, yz, zz] = work.inertias[index];
        let h = Vec3([hx, hy, hz]);
        let tensor = Mat3([Vec3([xx, xy, xz]), Vec3([xy, yy, yz]), Vec3([xz, yz, zz])]);
        let force = motion.acceleration.scale_add(mass, motion.gradient.mul_vec(h));
        let moment = tensor.mul_vec(motion.alpha)
            + motion.omega.cross(tensor.mul_vec(motion.omega))
            + h.cross(motion.acceleration);
        work.forces[index] = (force, moment);
        work.motions[index] = motion;
        work.placements[index] = (rotation, origin);
    }
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let (force, moment) = work.forces[index];
        let axis = Vec3::constant(node.axis.0);
        match node.motion {
            Motion::RevoluteZ { sign } => effort[node.rate] = moment.0[2] * S::from_f64(sign),
            Motion::Revolute => effort[node.rate] = moment.dot(axis),
            Motion::Prismatic => effort[node.rate] = force.dot(axis),
            Motion::Helical { pitch } => {
                effort[node.rate] = moment.dot(axis) + force.dot(axis) * S::from_f64(pitch);
            }
            Motion::Floating => {
                effort[node.rate..node.rate + 3].copy_from_slice(&force.0);
                effort[node.rate + 3..node.rate + 6].copy_from_slice(&moment.0);
            }
        }
        if let Some(p) = node.parent {
            let (rotation, origin) = &work.placements[index];
            let carried = rotation.mul_vec(force);
            let turned = rotation.mul_vec(moment) + origin.cross(carried);
            let (f, n) = work.forces[p];
            work.forces[p] = (f + carried, n + turned);
        }
    }
}
