//! Positions and Jacobians of points on bodies.

use super::block::load_all;
use super::groups::{GroupTask, groups, run};
use super::kinematics::KinematicsWorkspace;
use super::tree::Motion;
use super::{Dynamics, DynamicsWorkspace, MotionBlock};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// A point that moves with a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPoint {
    /// Index of the body in file order; `None`: the base.
    pub body: Option<usize>,
    /// Position in the body's frame, axes of the file, m.
    pub position: Vec3<f64>,
}

/// A point in internal terms: its node, and its position in the node's renamed axes.
#[derive(Clone, Copy)]
struct NodePoint {
    node: Option<usize>,
    position: Vec3<f64>,
}

impl NodePoint {
    #[inline(always)]
    fn place<S: Scalar>(&self, frames: &[(Mat3<S>, Vec3<S>)]) -> Vec3<S> {
        let position = Vec3::constant(self.position.0);
        match self.node {
            None => position,
            Some(k) => frames[k].0.mul_vec(position) + frames[k].1,
        }
    }
}

struct PointsTask<'a> {
    dynamics: &'a Dynamics,
    motion: &'a MotionBlock<'a>,
    points: &'a [NodePoint],
    stride: usize,
    out: &'a mut [f64],
}

impl GroupTask for PointsTask<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, width: usize, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let PointsTask { dynamics, motion, points, stride, out } = self;
        let mut work = KinematicsWorkspace::<S>::new(&dynamics.tree);
        let mut q = vec![S::zero(); dynamics.positions];
        for (sample, _) in groups(motion.samples, width) {
            load_all(motion.q, motion.stride, sample, &mut q, &load);
            dynamics.place(&q, &mut work);
            for (p, point) in points.iter().enumerate() {
                for (c, x) in point.place(&work.frames).0.into_iter().enumerate() {
                    store(x, &mut out[(3 * p + c) * stride + sample..]);
                }
            }
        }
    }
}

impl Dynamics {
    /// Positions of points over a block, in base axes, m: component `c` of point `p` at sample `s` is
    /// `out[(3 * p + c) * stride + s]`. Only the positions of the block are read.
    ///
    /// # Panics
    /// If `out` is too short or a body does not exist.
    pub fn points(&self, motion: &MotionBlock<'_>, points: &[BodyPoint], stride: usize, out: &mut [f64]) {
        assert!(stride >= motion.samples, "stride shorter than the block");
        let points: Vec<NodePoint> = points.iter().map(|p| self.node_point(p)).collect();
        run(motion.samples, PointsTask { dynamics: self, motion, points: &points, stride, out });
    }

    /// Positions of points at one pose, in base axes, and how they move with the rates:
    /// `d(position p)/dt = J_p q̇`, `J_p` (`3 × rates`, row-major) at `jacobians[3 * rates * p..]`.
    ///
    /// # Panics
    /// If a slice has the wrong length or a body does not exist.
    pub fn point_jacobians(
        &self,
        q: &[f64],
        points: &[BodyPoint],
        work: &mut DynamicsWorkspace<f64>,
        positions: &mut [Vec3<f64>],
        jacobians: &mut [f64],
    ) {
        let rates = self.rates;
        assert_eq!(q.len(), self.positions, "length of q");
        assert_eq!(positions.len(), points.len(), "length of positions");
        assert_eq!(jacobians.len(), 3 * rates * points.len(), "length of jacobians");
        self.place(q, &mut work.kinematics);
        let frames = &work.kinematics.frames;
        jacobians.fill(0.0);
        for (p, point) in points.iter().enumerate() {
            let point = self.node_point(point);
            let at = point.place(frames);
            positions[p] = at;
            let jacobian = &mut jacobians[3 * rates * p..][..3 * rates];
            let mut next = point.node;
            while let Some(k) = next {
                self.add_columns(k, &frames[k], at, jacobian);
                next = self.tree.nodes[k].parent;
            }
        }
    }

    /// Adds the velocity of a point at `at` for unit rates of the joint of node `k`.
    fn add_columns(&self, k: usize, frame: &(Mat3<f64>, Vec3<f64>), at: Vec3<f64>, jacobian: &mut [f64]) {
        let node = &self.tree.nodes[k];
        let (rotation, origin) = frame;
        let mut add = |rate: usize, velocity: Vec3<f64>| {
            let (column, ratio) = match &self.follows {
                None => (rate, 1.0),
                Some(follows) => (follows[rate].coordinate, follows[rate].ratio),
            };
            for (c, v) in velocity.0.iter().enumerate() {
                jacobian[c * self.rates + column] += ratio * v;
            }
        };
        let axis = rotation.mul_vec(node.axis);
        let turning = |axis: Vec3<f64>| axis.cross(at - *origin);
        match node.motion {
            Motion::RevoluteZ { .. } | Motion::Revolute => add(node.rate, turning(axis)),
            Motion::Prismatic => add(node.rate, axis),
            Motion::Helical { pitch } => add(node.rate, axis.scale_add(pitch, turning(axis))),
            Motion::Floating => {
                for (c, column) in rotation.0.into_iter().enumerate() {
                    add(node.rate + c, column);
                    add(node.rate + 3 + c, turning(column));
                }
            }
        }
    }

    fn node_point(&self, point: &BodyPoint) -> NodePoint {
        let Some(body) = point.body else { return NodePoint { node: None, position: point.position } };
        let Some(node) = self.tree.nodes.iter().position(|n| n.body == body) else {
            panic!("body {body} of {}", self.bodies)
        };
        let axes = self.tree.nodes[node].axes;
        NodePoint { node: Some(node), position: Vec3(axes.map(|k| point.position.0[k])) }
    }
}
