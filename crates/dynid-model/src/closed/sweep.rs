//! Where the bodies of a tree are in base axes, and how they move while no coordinate accelerates.

use crate::dynamics::motion::{Turns, placement};
use crate::dynamics::tree::{Motion, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// A body in base axes; internal axes of its node are the columns of `rotation`.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldBody<S> {
    pub(super) rotation: Mat3<S>,
    pub(super) origin: Vec3<S>,
    pub(super) omega: Vec3<S>,
    /// Velocity of the origin.
    pub(super) velocity: Vec3<S>,
    /// Angular acceleration and acceleration of the origin while all `q̈` are zero; no gravity.
    pub(super) alpha: Vec3<S>,
    pub(super) acceleration: Vec3<S>,
}

impl<S: Scalar> WorldBody<S> {
    #[inline(always)]
    pub(super) fn ground() -> Self {
        WorldBody {
            rotation: Mat3::identity(),
            origin: Vec3::zero(),
            omega: Vec3::zero(),
            velocity: Vec3::zero(),
            alpha: Vec3::zero(),
            acceleration: Vec3::zero(),
        }
    }

    /// Velocity of the body's point at `point` (base axes).
    #[inline(always)]
    pub(super) fn velocity_at(&self, point: Vec3<S>) -> Vec3<S> {
        self.velocity + self.omega.cross(point - self.origin)
    }

    /// Acceleration of the body's point at `point`.
    #[inline(always)]
    pub(super) fn acceleration_at(&self, point: Vec3<S>) -> Vec3<S> {
        let r = point - self.origin;
        self.acceleration + self.alpha.cross(r) + self.omega.cross(self.omega.cross(r))
    }
}

/// Unit motion of a coordinate in base axes: angular part, and velocity of the point at the base's origin.
#[derive(Clone, Copy, Debug)]
pub(super) struct Screw<S> {
    pub(super) turn: Vec3<S>,
    pub(super) slide: Vec3<S>,
}

impl<S: Scalar> Screw<S> {
    #[inline(always)]
    fn turning(axis: Vec3<S>, through: Vec3<S>) -> Self {
        Screw { turn: axis, slide: through.cross(axis) }
    }

    #[inline(always)]
    fn sliding(axis: Vec3<S>) -> Self {
        Screw { turn: Vec3::zero(), slide: axis }
    }

    /// Velocity of the point at `point`.
    #[inline(always)]
    pub(super) fn at(&self, point: Vec3<S>) -> Vec3<S> {
        self.slide + self.turn.cross(point)
    }
}

/// Memory of the sweep.
#[derive(Clone, Debug)]
pub(super) struct World<S> {
    pub(super) turns: Turns<S>,
    /// One per node.
    pub(super) bodies: Vec<WorldBody<S>>,
    /// One per rate.
    pub(super) screws: Vec<Screw<S>>,
}

impl<S: Scalar> World<S> {
    pub(super) fn new(tree: &Tree) -> Self {
        let still = Screw { turn: Vec3::zero(), slide: Vec3::zero() };
        World {
            turns: Turns::new(tree),
            bodies: vec![WorldBody::ground(); tree.nodes.len()],
            screws: vec![still; tree.rates],
        }
    }

    /// Rotations, origins and screws at positions `q`.
    pub(super) fn place(&mut self, tree: &Tree, q: &[S]) {
        self.turns.fill(tree, q);
        for (index, node) in tree.nodes.iter().enumerate() {
            let (rotation, origin) = placement(node, &self.turns, q);
            let (rotation, origin) = match node.parent {
                None => (rotation, origin),
                Some(p) => {
                    let parent = &self.bodies[p];
                    (parent.rotation.mul_mat(&rotation), parent.rotation.mul_vec(origin) + parent.origin)
                }
            };
            let body = &mut self.bodies[index];
            (body.rotation, body.origin) = (rotation, origin);
            let axis = || rotation.mul_vec(Vec3::constant(node.axis.0));
            let screws = &mut self.screws[node.rate..node.rate + node.rates];
            match node.motion {
                Motion::RevoluteZ { .. } | Motion::Revolute => screws[0] = Screw::turning(axis(), origin),
                Motion::Prismatic => screws[0] = Screw::sliding(axis()),
                Motion::Helical { pitch } => {
                    let axis = axis();
                    let turning = Screw::turning(axis, origin);
                    let slide = axis.scale_add(S::from_f64(pitch), turning.slide);
                    screws[0] = Screw { turn: axis, slide };
                }
                Motion::Floating => {
                    for (c, column) in rotation.0.into_iter().enumerate() {
                        screws[c] = Screw::sliding(column);
                        screws[3 + c] = Screw::turning(column, origin);
                    }
                }
            }
        }
    }

    /// Velocities, and accelerations while no coordinate accelerates, after [`World::place`].
    pub(super) fn drift(&mut self, tree: &Tree, dq: &[S]) {
        for (index, node) in tree.nodes.iter().enumerate() {
            let parent = node.parent.map_or_else(WorldBody::ground, |p| self.bodies[p]);
            let own = self.bodies[index];
            let (along, turn): (Vec3<S>, Vec3<S>) = match node.motion {
                Motion::Floating => {
                    let v = &dq[node.rate..node.rate + 6];
                    let [along, turn] = [[v[0], v[1], v[2]], [v[3], v[4], v[5]]];
                    (own.rotation.mul_vec(Vec3(along)), own.rotation.mul_vec(Vec3(turn)))
                }
                _ => {
                    let axis = own.rotation.mul_vec(Vec3::constant(node.axis.0));
                    let rate = dq[node.rate];
                    match node.motion {
                        Motion::Prismatic => (axis.scale(rate), Vec3::zero()),
                        Motion::Helical { pitch } => {
                            (axis.scale(rate * S::from_f64(pitch)), axis.scale(rate))
                        }
                        _ => (Vec3::zero(), axis.scale(rate)),
                    }
                }
            };
            let two = S::from_f64(2.0);
            let mut acceleration = parent.acceleration_at(own.origin) + parent.omega.cross(along).scale(two);
            if matches!(node.motion, Motion::Floating) {
                // Rates are in axes of the body: they turn with it.
                acceleration = acceleration + turn.cross(along);
            }
            self.bodies[index] = WorldBody {
                omega: parent.omega + turn,
                velocity: parent.velocity_at(own.origin) + along,
                alpha: parent.alpha + parent.omega.cross(turn),
                acceleration,
                ..own
            };
        }
    }
}
