//! Adjoints of inverse dynamics and regressor: derivatives of a scalar with respect to the motion, in one sweep outward
//! and one back.
//!
//! Both scalars are sums over bodies of virtual powers. With the unit motion `(Ω, V)` of a coordinate carried to a body,
//! its acceleration field `a + B r`, mass `m`, first moment `h` and second moment `Σ = ½ tr(I) 1 - I`,
//!
//! ```text
//! s = V·(m a + B h) + Ω·(h × a) + ⟨[Ω] Σ, B⟩
//! ```
//!
//! so that `∂s/∂a = m V + Ω × h` and `∂s/∂B = V hᵀ + [Ω] Σ`: the body itself never meets `ω` and `α`, which enter through
//! `B = [α] + ω ωᵀ - |ω|² 1` once per body. A parameter vector need not be physical for any of this.

use super::motion::{BodyMotion, Turns, placement, step};
use super::regressor::{TensorRows, own_axis};
use super::tree::{Motion, Node, Tree};
use dynid_algebra::scalar::Scalar;
use dynid_algebra::spatial::{Mat3, Vec3};

/// Adjoint of the motion of a body: derivative of the scalar with respect to each quantity.
#[derive(Clone, Copy, Debug)]
struct MotionBar<S> {
    omega: Vec3<S>,
    alpha: Vec3<S>,
    acceleration: Vec3<S>,
    gradient: Mat3<S>,
}

impl<S: Scalar> MotionBar<S> {
    #[inline(always)]
    fn zero() -> Self {
        MotionBar {
            omega: Vec3::zero(),
            alpha: Vec3::zero(),
            acceleration: Vec3::zero(),
            gradient: Mat3::zero(),
        }
    }
}

/// Angular and linear part of a virtual motion, or of the adjoint of one.
type Axis<S> = (Vec3<S>, Vec3<S>);

/// Reusable memory of both adjoints.
#[derive(Clone, Debug)]
pub(crate) struct AdjointWorkspace<S> {
    turns: Turns<S>,
    placements: Vec<(Mat3<S>, Vec3<S>)>,
    motions: Vec<BodyMotion<S>>,
    bars: Vec<MotionBar<S>>,
    axes: Vec<Axis<S>>,
    axis_bars: Vec<Axis<S>>,
    /// Adjoint of positions, rates and accelerations of the sample at hand.
    pub(crate) out: [Vec<S>; 3],
}

impl<S: Scalar> AdjointWorkspace<S> {
    /// # Panics
    /// If a joint floats: the derivative with respect to a unit quaternion is not offered.
    pub(crate) fn new(tree: &Tree, axes: usize) -> Self {
        assert!(
            tree.nodes.iter().all(|n| n.motion != Motion::Floating),
            "adjoints are not defined for floating joints"
        );
        let nodes = tree.nodes.len();
        AdjointWorkspace {
            turns: Turns::new(tree),
            placements: vec![(Mat3::zero(), Vec3::zero()); nodes],
            motions: vec![BodyMotion::ground(Vec3::zero()); nodes],
            bars: vec![MotionBar::zero(); nodes],
            axes: vec![(Vec3::zero(), Vec3::zero()); axes],
            axis_bars: vec![(Vec3::zero(), Vec3::zero()); axes],
            out: [tree.positions, tree.rates, tree.rates].map(|n| vec![S::zero(); n]),
        }
    }

    #[inline(always)]
    fn clear(&mut self) {
        self.bars.fill(MotionBar::zero());
        self.axis_bars.fill((Vec3::zero(), Vec3::zero()));
    }
}

/// Ten parameters in the form that virtual power takes them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Moments<S> {
    mass: S,
    first: Vec3<S>,
    tensor: [S; 6],
    /// Columns of `Σ`.
    second: Mat3<S>,
}

impl<S: Scalar> Moments<S> {
    #[inline(always)]
    pub(crate) fn new([mass, hx, hy, hz, xx, xy, xz, yy, yz, zz]: [S; 10]) -> Self {
        let half = S::from_f64(0.5);
        let trace = (xx + yy + zz) * half;
        let second =
            Mat3([Vec3([trace - xx, -xy, -xz]), Vec3([-xy, trace - yy, -yz]), Vec3([-xz, -yz, trace - zz])]);
        Moments { mass, first: Vec3([hx, hy, hz]), tensor: [xx, xy, xz, yy, yz, zz], second }
    }

    /// Adds the virtual power of the body along an axis to the adjoints of its motion and of the axis.
    #[inline(always)]
    fn power(
        &self,
        motion: &BodyMotion<S>,
        rows: &TensorRows<S>,
        (turn, slide): &Axis<S>,
        bar: &mut MotionBar<S>,
        (turn_bar, slide_bar): &mut Axis<S>,
    ) {
        bar.acceleration = slide.scale_add(self.mass, bar.acceleration + turn.cross(self.first));
        for k in 0..3 {
            let column = bar.gradient.0[k] + turn.cross(self.second.0[k]);
            bar.gradient.0[k] = slide.scale_add(self.first.0[k], column);
        }
        let force = motion.gradient.mul_vec(self.first);
        *slide_bar = *slide_bar + motion.acceleration.scale_add(self.mass, force);
        let mut moment = self.first.cross(motion.acceleration);
        for (column, entry) in rows.columns.iter().zip(self.tensor) {
            moment = column.scale_add(entry, moment);
        }
        *turn_bar = *turn_bar + moment;
    }
}

/// Adjoint of `Σ_j u_j · effort_j`, efforts of the given parameters (one [`Moments`] per node): into `work.out`.
#[inline(always)]
pub(crate) fn effort_sweep<S: Scalar>(
    tree: &Tree,
    state: (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    u: &[S],
    moments: &[Moments<S>],
    work: &mut AdjointWorkspace<S>,
) {
    let ground = outward(tree, state, gravity, work);
    work.clear();
    for (index, node) in tree.nodes.iter().enumerate() {
        let (turn, slide) = own_axis(node);
        let (turn, slide) = (turn.scale(u[node.rate]), slide.scale(u[node.rate]));
        let (rotation, origin) = &work.placements[index];
        work.axes[index] = match node.parent {
            None => (turn, slide),
            Some(p) => {
                let (t, s) = carried(rotation, *origin, &work.axes[p]);
                (t + turn, s + slide)
            }
        };
    }
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let motion = work.motions[index];
        let rows = TensorRows::new(motion.omega, motion.alpha);
        let (axis, mut axis_bar) = (work.axes[index], work.axis_bars[index]);
        moments[index].power(&motion, &rows, &axis, &mut work.bars[index], &mut axis_bar);
        if let Some(p) = node.parent {
            let (rotation, origin) = &work.placements[index];
            let (t, s) = carried_back(rotation, *origin, &axis_bar);
            let to = &mut work.axis_bars[p];
            *to = (to.0 + t, to.1 + s);
        }
        let moved = moved_axis(node, &axis, &axis_bar);
        inward(tree, index, state, &ground, moved, work);
    }
}

/// Adjoint of `Σ weights ∘ Y` over all entries of the regressor: into `work.out`.
///
/// `weights(k, node)` gives the ten weights of carried axis `k`, in the node's own order of parameters.
#[inline(always)]
pub(crate) fn regressor_sweep<S: Scalar>(
    tree: &Tree,
    state: (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    weights: impl Fn(usize, &Node) -> [S; 10],
    work: &mut AdjointWorkspace<S>,
) {
    let ground = outward(tree, state, gravity, work);
    work.clear();
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = &work.placements[index];
        let (of_others, own) = work.axes.split_at_mut(node.first_axis);
        if let Some(p) = node.parent {
            for (axis, from) in own.iter_mut().zip(&of_others[tree.nodes[p].carried()]) {
                *axis = carried(rotation, *origin, from);
            }
        }
        own[node.inherited] = own_axis(node);
    }
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let motion = work.motions[index];
        let rows = TensorRows::new(motion.omega, motion.alpha);
        let (rotation, origin) = work.placements[index];
        let mut bar = work.bars[index];
        let mut moved = S::zero();
        let (of_others, own_bars) = work.axis_bars.split_at_mut(node.first_axis);
        let axes = &work.axes[node.carried()];
        for (k, (axis, axis_bar)) in axes.iter().zip(own_bars).enumerate() {
            let moments = Moments::new(weights(node.first_axis + k, node));
            moments.power(&motion, &rows, axis, &mut bar, axis_bar);
            // The node's own axis, the last one, is the same in every motion.
            if k < node.inherited
                && let Some(p) = node.parent
            {
                let (t, s) = carried_back(&rotation, origin, axis_bar);
                let to = &mut of_others[tree.nodes[p].first_axis + k];
                *to = (to.0 + t, to.1 + s);
                moved += moved_axis(node, axis, axis_bar);
            }
        }
        work.bars[index] = bar;
        inward(tree, index, state, &ground, moved, work);
    }
}

/// Placements and motions of all bodies; returns the motion of the ground.
#[inline(always)]
fn outward<S: Scalar>(
    tree: &Tree,
    (q, dq, ddq): (&[S], &[S], &[S]),
    gravity: Vec3<S>,
    work: &mut AdjointWorkspace<S>,
) -> BodyMotion<S> {
    let ground = BodyMotion::ground(gravity);
    work.turns.fill(tree, q);
    for (index, node) in tree.nodes.iter().enumerate() {
        let (rotation, origin) = placement(node, &work.turns, q);
        let parent = node.parent.map_or(&ground, |p| &work.motions[p]);
        work.motions[index] = step(node, (&rotation, origin), parent, dq, ddq);
        work.placements[index] = (rotation, origin);
    }
    ground
}

/// A virtual motion of the parent, in the axes and at the origin of the body.
#[inline(always)]
fn carried<S: Scalar>(rotation: &Mat3<S>, origin: Vec3<S>, (turn, slide): &Axis<S>) -> Axis<S> {
    (rotation.tr_mul_vec(*turn), rotation.tr_mul_vec(*slide + turn.cross(origin)))
}

/// Transpose of [`carried`].
#[inline(always)]
fn carried_back<S: Scalar>(rotation: &Mat3<S>, origin: Vec3<S>, (turn, slide): &Axis<S>) -> Axis<S> {
    let force = rotation.mul_vec(*slide);
    (rotation.mul_vec(*turn) + origin.cross(force), force)
}

/// `z·(x̄ × x)`: derivative of `x = Rᵀ y` by the angle about the node's axis `z`, times `x̄`.
#[inline(always)]
fn turned<S: Scalar>(node: &Node, bar: Vec3<S>, x: Vec3<S>) -> S {
    match node.motion {
        Motion::RevoluteZ { sign } => (bar.0[0].mul_sub(x.0[1], bar.0[1] * x.0[0])) * S::from_f64(sign),
        _ => bar.cross(x).dot(Vec3::constant(node.axis.0)),
    }
}

/// Derivative of a carried axis by the node's own position, times the adjoint of the axis.
#[inline(always)]
fn moved_axis<S: Scalar>(node: &Node, (turn, slide): &Axis<S>, (turn_bar, slide_bar): &Axis<S>) -> S {
    let by_angle = || turned(node, *turn_bar, *turn) + turned(node, *slide_bar, *slide);
    let by_slide = || slide_bar.cross(*turn).dot(Vec3::constant(node.axis.0));
    match node.motion {
        Motion::RevoluteZ { .. } | Motion::Revolute => by_angle(),
        Motion::Prismatic => by_slide(),
        Motion::Helical { pitch } => by_angle() + by_slide() * S::from_f64(pitch),
        Motion::Floating => unreachable!("refused when the workspace is made"),
    }
}

/// Hands the adjoint of a body's motion on to its joint (into `work.out`) and to its parent.
///
/// `moved`: what the axes carried through the joint add to the derivative by its position.
#[inline(always)]
fn inward<S: Scalar>(
    tree: &Tree,
    index: usize,
    (_, dq, ddq): (&[S], &[S], &[S]),
    ground: &BodyMotion<S>,
    moved: S,
    work: &mut AdjointWorkspace<S>,
) {
    let node = &tree.nodes[index];
    let motion = &work.motions[index];
    let MotionBar { omega, alpha, acceleration, gradient: g } = work.bars[index];
    let [gx, gy, gz] = g.0.map(|c| c.0);
    let trace = gx[0] + gy[1] + gz[2];
    let omega =
        omega + g.mul_vec(motion.omega) + g.tr_mul_vec(motion.omega) - motion.omega.scale(trace + trace);
    let alpha = alpha + Vec3([gy[2] - gz[1], gz[0] - gx[2], gx[1] - gy[0]]);

    let axis = Vec3::constant(node.axis.0);
    let (rotation, origin) = &work.placements[index];
    let parent = node.parent.map_or(ground, |p| &work.motions[p]);
    let (v, dv) = (dq[node.rate], ddq[node.rate]);
    let [out_q, out_dq, out_ddq] = &mut work.out;
    let (out_q, out_dq, out_ddq) =
        (&mut out_q[node.position], &mut out_dq[node.rate], &mut out_ddq[node.rate]);

    // ω of the parent up to its part along the axis, which no product below sees.
    let w = motion.omega;
    let transverse = w.cross(axis);
    let carried = rotation.mul_vec(acceleration);
    // Adjoints of ω' = Rᵀ ω_l; those of α' and of the acceleration pass unchanged.
    let omega_parent = match node.motion {
        Motion::RevoluteZ { sign } => {
            let sign = S::from_f64(sign);
            let signed = v * sign;
            let [x, y, z] = omega.0;
            let [a1, a2, a3] = alpha.0;
            let omega_parent = Vec3([x - a2 * signed, a1.mul_add(signed, y), z]);
            let alpha_parent = motion.alpha - transverse.scale(v);
            *out_ddq = a3 * sign;
            *out_dq = z * sign + alpha.dot(transverse);
            *out_q = moved
                + turned(node, omega_parent, w)
                + turned(node, alpha, alpha_parent)
                + turned(node, acceleration, motion.acceleration);
            omega_parent
        }
        Motion::Revolute => {
            let omega_parent = axis.cross(alpha).scale_add(v, omega);
            *out_ddq = alpha.dot(axis);
            *out_dq = omega.dot(axis) + alpha.dot(transverse);
            *out_q = moved
                + turned(node, omega_parent, w)
                + turned(node, alpha, motion.alpha - transverse.scale(v))
                + turned(node, acceleration, motion.acceleration);
            omega_parent
        }
        Motion::Prismatic => {
            let two = S::from_f64(2.0);
            *out_ddq = acceleration.dot(axis);
            *out_dq = acceleration.dot(transverse) * two;
            *out_q = moved + carried.dot(parent.gradient.mul_vec(rotation.mul_vec(axis)));
            axis.cross(acceleration).scale_add(v * two, omega)
        }
        Motion::Helical { pitch } => {
            let pitch = S::from_f64(pitch);
            let two_pitch = pitch + pitch;
            let omega_parent = axis.cross(acceleration.scale(two_pitch) + alpha).scale_add(v, omega);
            let before = motion.acceleration - axis.scale(dv * pitch) - transverse.scale(v * two_pitch);
            *out_ddq = alpha.dot(axis) + acceleration.dot(axis) * pitch;
            *out_dq = omega.dot(axis) + (alpha + acceleration.scale(two_pitch)).dot(transverse);
            *out_q = moved
                + carried.dot(parent.gradient.mul_vec(rotation.mul_vec(axis))) * pitch
                + turned(node, omega_parent, w)
                + turned(node, alpha, motion.alpha - transverse.scale(v))
                + turned(node, acceleration, before);
            omega_parent
        }
        Motion::Floating => unreachable!("refused when the workspace is made"),
    };
    if let Some(p) = node.parent {
        let bar = &mut work.bars[p];
        bar.omega = bar.omega + rotation.mul_vec(omega_parent);
        bar.alpha = bar.alpha + rotation.mul_vec(alpha);
        bar.acceleration = bar.acceleration + carried;
        for k in 0..3 {
            bar.gradient.0[k] = carried.scale_add(origin.0[k], bar.gradient.0[k]);
        }
    }
}
