//! Accelerations from efforts by the articulated-body algorithm (Featherstone 2008, section 7.3).
//!
//! Accelerations are those of the frame origin (not spatial ones), so a body's wrench is `f = m a - h × α + …`,
//! `n = I α + h × a + …`, and no linear velocities are needed. A joint with six rates is six joints of one rate at the
//! same place: its rates are eliminated one after the other.

use super::motion::{BodyMotion, Turns, gradient, placement, step};
use super::tree::{Motion, Node, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// A pair of an angular and a linear vector.
type Pair<S> = (Vec3<S>, Vec3<S>);

/// `n = I α + H a + n₀`, `f = Hᵀ α + M a + f₀`: what a body and all that hangs on it answers to its acceleration.
#[derive(Clone, Copy, Debug)]
struct Articulated<S> {
    tensor: Mat3<S>,
    coupling: Mat3<S>,
    mass: Mat3<S>,
    bias: Pair<S>,
}

/// Reusable memory of the three sweeps.
#[derive(Clone, Debug)]
pub(crate) struct ArticulatedWorkspace<S> {
    turns: Turns<S>,
    inertias: Vec<[S; 10]>,
    motions: Vec<BodyMotion<S>>,
    placements: Vec<(Mat3<S>, Vec3<S>)>,
    bodies: Vec<Articulated<S>>,
    /// Velocity-dependent part of each body's acceleration relative to its parent's.
    drift: Vec<Pair<S>>,
    /// Per rate: wrench of a unit acceleration, inverse of the inertia that it moves, effort left for it.
    columns: Vec<Pair<S>>,
    inverse: Vec<S>,
    left: Vec<S>,
    accelerations: Vec<Pair<S>>,
    rest: Vec<S>,
}

impl<S: Scalar> ArticulatedWorkspace<S> {
    pub(crate) fn new(tree: &Tree) -> Self {
        let (nodes, zero) = (tree.nodes.len(), (Vec3::zero(), Vec3::zero()));
        let empty =
            Articulated { tensor: Mat3::zero(), coupling: Mat3::zero(), mass: Mat3::zero(), bias: zero };
        ArticulatedWorkspace {
            turns: Turns::new(tree),
            inertias: vec![[S::zero(); 10]; nodes],
            motions: vec![BodyMotion::ground(Vec3::zero()); nodes],
            placements: vec![(Mat3::zero(), Vec3::zero()); nodes],
            bodies: vec![empty; nodes],
            drift: vec![zero; nodes],
            columns: vec![zero; tree.rates],
            inverse: vec![S::zero(); tree.rates],
            left: vec![S::zero(); tree.rates],
            accelerations: vec![zero; nodes],
            rest: vec![S::zero(); tree.rates],
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
}

/// Motion of a body per unit of its joint's `k`-th rate.
#[inline(always)]
fn unit_motion<S: Scalar>(node: &Node, k: usize) -> Pair<S> {
    let axis = Vec3::constant(node.axis.0);
    match node.motion {
        Motion::RevoluteZ { sign } => (Vec3([S::zero(), S::zero(), S::from_f64(sign)]), Vec3::zero()),
        Motion::Revolute => (axis, Vec3::zero()),
        Motion::Prismatic => (Vec3::zero(), axis),
        Motion::Helical { pitch } => (axis, axis.scale(S::from_f64(pitch))),
        Motion::Floating => {
            let mut unit = Vec3::zero();
            unit.0[k % 3] = S::one();
            if k < 3 { (Vec3::zero(), unit) } else { (unit, Vec3::zero()) }
        }
    }
}

/// `m - a bᵀ · factor`.
#[inline(always)]
fn minus_outer<S: Scalar>(m: Mat3<S>, a: Vec3<S>, b: Vec3<S>, factor: S) -> Mat3<S> {
    let a = a.scale(-factor);
    let [x, y, z] = m.0;
    Mat3([a.scale_add(b.0[0], x), a.scale_add(b.0[1], y), a.scale_add(b.0[2], z)])
}

/// `[p] M` with `[p] v = p × v`.
#[inline(always)]
fn cross_columns<S: Scalar>(p: Vec3<S>, m: &Mat3<S>) -> Mat3<S> {
    Mat3(m.0.map(|c| p.cross(c)))
}

#[inline(always)]
fn plus<S: Scalar>((a, b): Pair<S>, (c, d): Pair<S>) -> Pair<S> {
    (a + c, b + d)
}

#[inline(always)]
fn scaled_plus<S: Scalar>((a, b): Pair<S>, factor: S, (c, d): Pair<S>) -> Pair<S> {
    (a.scale_add(factor, c), b.scale_add(factor, d))
}

#[inline(always)]
fn dot<S: Scalar>((a, b): Pair<S>, (c, d): Pair<S>) -> S {
    a.dot(c) + b.dot(d)
}

impl<S: Scalar> Articulated<S> {
    #[inline(always)]
    fn of_body([mass, hx, hy, hz, xx, xy, xz, yy, yz, zz]: [S; 10], omega: Vec3<S>) -> Self {
        let zero = S::zero();
        let tensor = Mat3([Vec3([xx, xy, xz]), Vec3([xy, yy, yz]), Vec3([xz, yz, zz])]);
        let h = Vec3([hx, hy, hz]);
        Articulated {
            tensor,
            coupling: Mat3([Vec3([zero, hz, -hy]), Vec3([-hz, zero, hx]), Vec3([hy, -hx, zero])]),
            mass: Mat3([Vec3([mass, zero, zero]), Vec3([zero, mass, zero]), Vec3([zero, zero, mass])]),
            bias: (omega.cross(tensor.mul_vec(omega)), omega.cross(omega.cross(h))),
        }
    }

    /// Wrench of an acceleration, without the bias.
    #[inline(always)]
    fn times(&self, (alpha, a): Pair<S>) -> Pair<S> {
        (
            self.tensor.mul_vec(alpha) + self.coupling.mul_vec(a),
            self.coupling.tr_mul_vec(alpha) + self.mass.mul_vec(a),
        )
    }

    /// Lets one rate move freely under what effort is left for it.
    #[inline(always)]
    fn release(&mut self, (n, f): Pair<S>, inverse: S, left: S) {
        self.tensor = minus_outer(self.tensor, n, n, inverse);
        self.coupling = minus_outer(self.coupling, n, f, inverse);
        self.mass = minus_outer(self.mass, f, f, inverse);
        self.bias = scaled_plus((n, f), inverse * left, self.bias);
    }

    /// Adds a child whose frame sits at `origin`, turned by `rotation`.
    #[inline(always)]
    fn add(&mut self, child: &Self, rotation: &Mat3<S>, origin: Vec3<S>) {
        let back = rotation.transpose();
        let turn = |m: &Mat3<S>| rotation.mul_mat(m).mul_mat(&back);
        let (tensor, coupling, mass) = (turn(&child.tensor), turn(&child.coupling), turn(&child.mass));
        let arm = cross_columns(origin, &coupling.transpose());
        let mass_arm = cross_columns(origin, &mass);
        self.tensor =
            self.tensor + tensor + arm + arm.transpose() + cross_columns(origin, &mass_arm.transpose());
        self.coupling = self.coupling + coupling + mass_arm;
        self.mass = self.mass + mass;
        let force = rotation.mul_vec(child.bias.1);
        let moment = rotation.mul_vec(child.bias.0) + origin.cross(force);
        self.bias = plus(self.bias, (moment, force));
    }
}

/// Writes the acceleration of every joint rate for the inertias loaded into the workspace.
///
/// `added(rate)`: inertia of that rate's own drive. Gives the rate, if any, whose inertia is not positive.
#[inline(always)]
pub(crate) fn sweep<S: Scalar>(
    tree: &Tree,
    (q, dq, effort): (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    added: impl Fn(usize) -> S,
    work: &mut ArticulatedWorkspace<S>,
    ddq: &mut [S],
) -> Option<usize> {
    let ground = BodyMotion::ground(Vec3::zero());
    work.turns.fill(tree, q);
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = placement(node, &work.turns, q);
        let parent = node.parent.map_or(&ground, |p| &work.motions[p]);
        let relative = step(node, (&rotation, origin), parent, dq, &work.rest);
        work.drift[index] = (relative.alpha, relative.acceleration);
        work.bodies[index] = Articulated::of_body(work.inertias[index], relative.omega);
        work.motions[index] = BodyMotion {
            omega: relative.omega,
            alpha: Vec3::zero(),
            acceleration: Vec3::zero(),
            gradient: gradient(relative.omega, Vec3::zero()),
        };
        work.placements[index] = (rotation, origin);
    }
    let mut fault = None;
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let mut body = work.bodies[index];
        for k in (0..node.rates).rev() {
            let (rate, unit) = (node.rate + k, unit_motion(node, k));
            let column = body.times(unit);
            let inertia = dot(unit, column) + added(rate);
            if !inertia.is_positive_finite() {
                // What follows a first fault is not finite: that joint is the one to name.
                fault = fault.or(Some(rate));
            }
            let left = effort[rate] - dot(unit, body.bias);
            let inverse = inertia.recip();
            body.release(column, inverse, left);
            work.columns[rate] = column;
            work.inverse[rate] = inverse;
            work.left[rate] = left;
        }
        if let Some(p) = node.parent {
            body.bias = plus(body.bias, body.times(work.drift[index]));
            let (rotation, origin) = &work.placements[index];
            work.bodies[p].add(&body, rotation, *origin);
        }
    }
    for (index, node) in tree.nodes.iter().enumerate() {
        let (alpha, a) = node.parent.map_or((Vec3::zero(), -gravity), |p| work.accelerations[p]);
        let (rotation, origin) = &work.placements[index];
        let carried = (rotation.tr_mul_vec(alpha), rotation.tr_mul_vec(a + alpha.cross(*origin)));
        let mut acceleration = plus(carried, work.drift[index]);
        for k in 0..node.rates {
            let rate = node.rate + k;
            let value = (work.left[rate] - dot(work.columns[rate], acceleration)) * work.inverse[rate];
            ddq[rate] = value;
            acceleration = scaled_plus(unit_motion(node, k), value, acceleration);
        }
        work.accelerations[index] = acceleration;
    }
    fault
}
