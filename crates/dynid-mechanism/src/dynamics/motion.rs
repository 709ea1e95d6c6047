//! The outward recursion: rotations, velocities and accelerations of all bodies.

use super::tree::{Motion, Node, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// Motion of a body in its own axes.
#[derive(Clone, Copy, Debug)]
pub struct BodyMotion<S> {
    /// Angular velocity.
    pub omega: Vec3<S>,
    /// Angular acceleration.
    pub alpha: Vec3<S>,
    /// Acceleration of the origin minus gravity.
    pub acceleration: Vec3<S>,
    /// `B = [α] + [ω][ω]`: acceleration of a point at `r` is `a + B r`.
    pub gradient: Mat3<S>,
}

impl<S: Scalar> BodyMotion<S> {
    /// The ground under gravity `g`: at rest, accelerated by `-g`.
    #[inline(always)]
    pub fn ground(gravity: Vec3<S>) -> Self {
        BodyMotion {
            omega: Vec3::zero(),
            alpha: Vec3::zero(),
            acceleration: -gravity,
            gradient: Mat3::zero(),
        }
    }
}

/// Acceleration of a point per unit of its place: `[α]× + [ω]×²`.
#[inline(always)]
pub fn gradient<S: Scalar>(omega: Vec3<S>, alpha: Vec3<S>) -> Mat3<S> {
    let [x, y, z] = omega.0;
    let [a1, a2, a3] = alpha.0;
    let (xx, yy, zz) = (x * x, y * y, z * z);
    Mat3([
        Vec3([-(yy + zz), x.mul_add(y, a3), x.mul_sub(z, a2)]),
        Vec3([x.mul_sub(y, a3), -(xx + zz), y.mul_add(z, a1)]),
        Vec3([x.mul_add(z, a2), y.mul_sub(z, a1), -(xx + yy)]),
    ])
}

/// Sines and cosines of all joint angles.
#[derive(Clone, Debug, Default)]
pub struct Turns<S> {
    angles: Vec<S>,
    sin_cos: Vec<(S, S)>,
}

impl<S: Scalar> Turns<S> {
    /// Room for the angles of a tree.
    pub fn new(tree: &Tree) -> Self {
        let n = tree.turns.len();
        Turns { angles: vec![S::zero(); n], sin_cos: vec![(S::zero(), S::zero()); n] }
    }

    #[inline(always)]
    /// Fills sines and cosines at positions `q`.
    pub fn fill(&mut self, tree: &Tree, q: &[S]) {
        for (angle, (position, sign)) in self.angles.iter_mut().zip(&tree.turns) {
            *angle = q[*position] * S::from_f64(*sign);
        }
        S::sin_cos_all(&self.angles, &mut self.sin_cos);
    }
}

/// Rotation and origin of a body in its parent.
#[inline(always)]
pub fn placement<S: Scalar>(node: &Node, turns: &Turns<S>, q: &[S]) -> (Mat3<S>, Vec3<S>) {
    let origin = Vec3::constant(node.origin.0);
    match node.motion {
        Motion::RevoluteZ { .. } => {
            let (s, c) = turns.sin_cos[node.turn];
            let [x, y, z] = Mat3::constant(&node.fixed).0;
            (Mat3([x.scale_add(c, y.scale(s)), y.scale_add(c, x.scale(-s)), z]), origin)
        }
        Motion::Revolute => (turned(node, turns.sin_cos[node.turn]), origin),
        Motion::Prismatic => {
            let rotation = Mat3::constant(&node.fixed);
            let along = rotation.mul_vec(Vec3::constant(node.axis.0));
            (rotation, along.scale_add(q[node.position], origin))
        }
        Motion::Helical { pitch } => {
            let along = Mat3::constant(&node.fixed).mul_vec(Vec3::constant(node.axis.0));
            let slide = q[node.position] * S::from_f64(pitch);
            (turned(node, turns.sin_cos[node.turn]), along.scale_add(slide, origin))
        }
        Motion::Floating => {
            let q = &q[node.position..node.position + 7];
            let fixed = Mat3::constant(&node.fixed);
            let rotation = fixed.mul_mat(&quaternion_rotation([q[3], q[4], q[5], q[6]]));
            (rotation, fixed.mul_vec(Vec3([q[0], q[1], q[2]])) + origin)
        }
    }
}

/// `A0 + cos q A1 + sin q A2` with the constants of the node.
#[inline(always)]
fn turned<S: Scalar>(node: &Node, (s, c): (S, S)) -> Mat3<S> {
    let [a0, a1, a2] = &node.around;
    Mat3::constant(a0) + Mat3::constant(a1) * c + Mat3::constant(a2) * s
}

/// Rotation matrix of a unit quaternion `(x, y, z, w)`.
#[inline(always)]
fn quaternion_rotation<S: Scalar>([x, y, z, w]: [S; 4]) -> Mat3<S> {
    let two = S::from_f64(2.0);
    let one = S::one();
    Mat3([
        Vec3([one - two * (y * y + z * z), two * (x * y + w * z), two * (x * z - w * y)]),
        Vec3([two * (x * y - w * z), one - two * (x * x + z * z), two * (y * z + w * x)]),
        Vec3([two * (x * z + w * y), two * (y * z - w * x), one - two * (x * x + y * y)]),
    ])
}

/// Motion of a body from that of its parent.
#[inline(always)]
pub fn step<S: Scalar>(
    node: &Node,
    (rotation, origin): (&Mat3<S>, Vec3<S>),
    parent: &BodyMotion<S>,
    dq: &[S],
    ddq: &[S],
) -> BodyMotion<S> {
    let w = rotation.tr_mul_vec(parent.omega);
    let alpha = rotation.tr_mul_vec(parent.alpha);
    let a = rotation.tr_mul_vec(parent.acceleration + parent.gradient.mul_vec(origin));
    let (omega, alpha, acceleration) = match node.motion {
        Motion::RevoluteZ { sign } => {
            let sign = S::from_f64(sign);
            let (v, dv) = (dq[node.rate] * sign, ddq[node.rate] * sign);
            let [x, y, z] = w.0;
            let [a1, a2, a3] = alpha.0;
            (Vec3([x, y, z + v]), Vec3([y.mul_add(v, a1), a2 - x * v, a3 + dv]), a)
        }
        Motion::Revolute => {
            let axis = Vec3::constant(node.axis.0);
            turning(axis, w, alpha, dq[node.rate], ddq[node.rate], a)
        }
        Motion::Prismatic => {
            let (v, dv) = (dq[node.rate], ddq[node.rate]);
            let axis = Vec3::constant(node.axis.0);
            (w, alpha, sliding(axis, w, v, dv, a))
        }
        Motion::Helical { pitch } => {
            let pitch = S::from_f64(pitch);
            let (v, dv) = (dq[node.rate], ddq[node.rate]);
            let axis = Vec3::constant(node.axis.0);
            let a = sliding(axis, w, v * pitch, dv * pitch, a);
            turning(axis, w, alpha, v, dv, a)
        }
        Motion::Floating => {
            let v = &dq[node.rate..node.rate + 6];
            let dv = &ddq[node.rate..node.rate + 6];
            let (lin, ang) = (Vec3([v[0], v[1], v[2]]), Vec3([v[3], v[4], v[5]]));
            let (dlin, dang) = (Vec3([dv[0], dv[1], dv[2]]), Vec3([dv[3], dv[4], dv[5]]));
            let coriolis = (w.scale(S::from_f64(2.0)) + ang).cross(lin);
            (w + ang, alpha + w.cross(ang) + dang, a + dlin + coriolis)
        }
    };
    BodyMotion { omega, alpha, acceleration, gradient: gradient(omega, alpha) }
}

#[inline(always)]
fn turning<S: Scalar>(
    axis: Vec3<S>,
    w: Vec3<S>,
    alpha: Vec3<S>,
    v: S,
    dv: S,
    a: Vec3<S>,
) -> (Vec3<S>, Vec3<S>, Vec3<S>) {
    (axis.scale_add(v, w), w.cross(axis).scale_add(v, axis.scale_add(dv, alpha)), a)
}

#[inline(always)]
fn sliding<S: Scalar>(axis: Vec3<S>, w: Vec3<S>, v: S, dv: S, a: Vec3<S>) -> Vec3<S> {
    w.cross(axis).scale_add(v * S::from_f64(2.0), axis.scale_add(dv, a))
}
