//! Dynamics of a mechanism: inverse and forward dynamics, regressor, kinematics, mass matrix, energies.
//!
//! Notation and equations: the chapter *Equations on one page* of the book (`docs/book/src/theory/equations.md`), after Featherstone 2008 and
//! Atkeson, An & Hollerbach 1986. Frames: body quantities in axes of the body's joint frame, gravity in base axes.

mod adjoint;
mod adjoint_block;
mod articulated_body;
mod block;
mod energy;
mod forward_dynamics;
mod groups;
mod inverse_dynamics;
mod kinematics;
pub mod motion;
mod points;
pub mod regressor;
pub mod tree;

pub use crate::motion_block::MotionBlock;
pub use adjoint_block::MotionAdjoint;
pub use block::Slots;
pub use energy::Energy;
pub use forward_dynamics::{AddedInertia, ForwardDynamicsWorkspace, LoadedState, NotPositive};
pub use points::BodyPoint;

use crate::mechanism::{Follow, Mechanism};
use dynid_algebra::scalar::{FusedTask, Scalar, run_fused};
use dynid_algebra::spatial::Vec3;
use inverse_dynamics::InverseDynamicsWorkspace;
use kinematics::KinematicsWorkspace;
use regressor::RegressorWorkspace;
use tree::Tree;

/// The recursions of one mechanism.
///
/// All functions take positions, rates and accelerations of the independent coordinates in the order of
/// [`Mechanism::rate_names`] and give efforts in the same order. Efforts are those of the rigid bodies alone:
/// no friction, no rotors.
#[derive(Clone, Debug)]
pub struct Dynamics {
    tree: Tree,
    follows: Option<Vec<Follow>>,
    /// Coupled coordinates, not joints.
    rates: usize,
    positions: usize,
    gravity: Vec3<f64>,
    bodies: usize,
    dense_slots: Vec<usize>,
}

/// Memory of [`Dynamics`], reusable from sample to sample.
#[derive(Clone, Debug)]
pub struct DynamicsWorkspace<S: Scalar> {
    inverse: InverseDynamicsWorkspace<S>,
    regressor: RegressorWorkspace<S>,
    fused: FusedWorkspace<S::Fused>,
    kinematics: KinematicsWorkspace<S>,
    joint_state: [Vec<S>; 3],
    joint_effort: Vec<S>,
    joint_regressor: Vec<S>,
}

impl DynamicsWorkspace<f64> {
    /// Wrench of a node from whichever version of the recursion ran on this processor.
    fn last_wrench(&self, node: usize) -> (Vec3<f64>, Vec3<f64>) {
        struct Pick<'a>(&'a DynamicsWorkspace<f64>, usize, &'a mut (Vec3<f64>, Vec3<f64>));
        impl FusedTask for Pick<'_> {
            #[inline(always)]
            fn fused(self) {
                let (force, moment) = self.0.fused.inverse.wrench(self.1);
                *self.2 = (Vec3(force.0.map(f64::unfuse)), Vec3(moment.0.map(f64::unfuse)));
            }
            fn plain(self) {
                *self.2 = self.0.inverse.wrench(self.1);
            }
        }
        let mut wrench = (Vec3::zero(), Vec3::zero());
        run_fused(Pick(self, node, &mut wrench));
        wrench
    }
}

/// Memory of the recursions for the fused twin of a scalar.
#[derive(Clone, Debug)]
struct FusedWorkspace<F> {
    inverse: InverseDynamicsWorkspace<F>,
    regressor: RegressorWorkspace<F>,
    state: [Vec<F>; 3],
    effort: Vec<F>,
}

/// Motion at one instant, and the gravity it happens under.
#[derive(Clone, Copy, Debug)]
pub struct State<'a, S> {
    /// Positions: rad, m; `x y z qx qy qz qw` for a floating joint.
    pub q: &'a [S],
    /// Rates.
    pub dq: &'a [S],
    /// Time derivatives of the rates.
    pub ddq: &'a [S],
    /// Acceleration of gravity in base axes, m/s²; `None`: the mechanism's.
    pub gravity: Option<Vec3<S>>,
}

impl Dynamics {
    /// Compiles the recursions of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let tree = Tree::new(mechanism);
        let bodies = mechanism.bodies().len();
        let mut dense_slots = vec![0; tree.axis_rate.len()];
        for node in &tree.nodes {
            let rates = &tree.axis_rate[node.carried()];
            for (slot, rate) in dense_slots[node.carried()].iter_mut().zip(rates) {
                *slot = rate * 10 * bodies + 10 * node.body;
            }
        }
        Dynamics {
            tree,
            follows: mechanism.follows().map(<[Follow]>::to_vec),
            rates: mechanism.rates(),
            positions: mechanism.positions(),
            gravity: mechanism.gravity(),
            bodies,
            dense_slots,
        }
    }

    /// Returns the recursions with every joint a coordinate for itself.
    pub fn uncoupled(mut self) -> Self {
        self.follows = None;
        self.rates = self.tree.rates;
        self.positions = self.tree.positions;
        self
    }

    /// Memory for any of the functions below.
    pub fn workspace<S: Scalar>(&self) -> DynamicsWorkspace<S> {
        let joints = if self.follows.is_some() { self.tree.rates } else { 0 };
        let joint_positions = if self.follows.is_some() { self.tree.positions } else { 0 };
        DynamicsWorkspace {
            inverse: InverseDynamicsWorkspace::new(&self.tree),
            regressor: RegressorWorkspace::new(&self.tree),
            fused: FusedWorkspace {
                inverse: InverseDynamicsWorkspace::new(&self.tree),
                regressor: RegressorWorkspace::new(&self.tree),
                state: [self.tree.positions, self.tree.rates, self.tree.rates]
                    .map(|n| vec![S::zero().fuse(); n]),
                effort: vec![S::zero().fuse(); self.tree.rates],
            },
            kinematics: KinematicsWorkspace::new(&self.tree),
            joint_state: [vec![S::zero(); joint_positions], vec![S::zero(); joints], vec![S::zero(); joints]],
            joint_effort: vec![S::zero(); joints],
            joint_regressor: vec![S::zero(); joints * 10 * self.bodies],
        }
    }

    /// Number of independent rates (efforts).
    pub fn rates(&self) -> usize {
        self.rates
    }

    /// Number of entries of the position vector.
    pub fn positions(&self) -> usize {
        self.positions
    }

    /// Number of standard inertial parameters.
    pub fn inertial_parameters(&self) -> usize {
        10 * self.bodies
    }

    /// Acceleration of gravity in base axes, m/s².
    pub fn gravity(&self) -> Vec3<f64> {
        self.gravity
    }

    fn check<S>(&self, state: &State<'_, S>) {
        assert_eq!(state.q.len(), self.positions, "length of q");
        assert_eq!(state.dq.len(), self.rates, "length of dq");
        assert_eq!(state.ddq.len(), self.rates, "length of ddq");
    }

    fn gravity_of<S: Scalar>(&self, state: &State<'_, S>) -> Vec3<S> {
        state.gravity.unwrap_or_else(|| Vec3::constant(self.gravity.0))
    }

    /// Joint values of coupled coordinates.
    fn expand<S: Scalar>(&self, state: &State<'_, S>, joint_state: &mut [Vec<S>; 3]) {
        let Some(follows) = &self.follows else { return };
        let [q, dq, ddq] = joint_state;
        for ((dq, ddq), f) in dq.iter_mut().zip(ddq).zip(follows) {
            *dq = state.dq[f.coordinate] * S::from_f64(f.ratio);
            *ddq = state.ddq[f.coordinate] * S::from_f64(f.ratio);
        }
        self.expand_positions(state.q, q);
    }

    /// Joint positions of coupled coordinates.
    #[inline(always)]
    fn expand_positions<S: Scalar>(&self, q: &[S], joint_q: &mut [S]) {
        let Some(follows) = &self.follows else {
            joint_q.copy_from_slice(q);
            return;
        };
        for node in &self.tree.nodes {
            let f = &follows[node.rate];
            // Positions and rates of coupled mechanisms are numbered alike up to the extra entry of quaternions.
            let from = f.coordinate + self.quaternions_before(f.coordinate);
            if node.rates == 1 {
                joint_q[node.position] = q[from] * S::from_f64(f.ratio) + S::from_f64(f.offset);
            } else {
                joint_q[node.position..node.position + 7].copy_from_slice(&q[from..from + 7]);
            }
        }
    }

    /// Number of floating joints whose coordinates come before this one.
    fn quaternions_before(&self, coordinate: usize) -> usize {
        let Some(follows) = &self.follows else { return 0 };
        self.tree.nodes.iter().filter(|n| n.rates == 6 && follows[n.rate].coordinate < coordinate).count()
    }

    /// Efforts of a motion, `n` numbers (N m or N).
    ///
    /// `inertias`: ten standard parameters per body in file order ([`Mechanism::inertia_vector`]).
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn inverse_dynamics<S: Scalar>(
        &self,
        state: &State<'_, S>,
        inertias: &[S],
        work: &mut DynamicsWorkspace<S>,
        effort: &mut [S],
    ) {
        self.check(state);
        assert_eq!(inertias.len(), 10 * self.bodies, "length of inertias");
        assert_eq!(effort.len(), self.rates, "length of effort");
        let gravity = self.gravity_of(state);
        match &self.follows {
            None => self.joint_efforts((state.q, state.dq, state.ddq), gravity, inertias, work, effort),
            Some(follows) => {
                let mut joint_state = std::mem::take(&mut work.joint_state);
                let mut joint_effort = std::mem::take(&mut work.joint_effort);
                self.expand(state, &mut joint_state);
                let [q, dq, ddq] = &joint_state;
                self.joint_efforts((q, dq, ddq), gravity, inertias, work, &mut joint_effort);
                effort.fill(S::zero());
                for (e, f) in joint_effort.iter().zip(follows) {
                    effort[f.coordinate] += *e * S::from_f64(f.ratio);
                }
                work.joint_state = joint_state;
                work.joint_effort = joint_effort;
            }
        }
    }

    fn joint_efforts<S: Scalar>(
        &self,
        state: (&[S], &[S], &[S]),
        gravity: Vec3<S>,
        inertias: &[S],
        work: &mut DynamicsWorkspace<S>,
        effort: &mut [S],
    ) {
        run_fused(EffortTask { tree: &self.tree, state, gravity, inertias, work, effort });
    }

    /// Regressor `Y` with `effort = Y φ`, row-major, `n × 10·bodies`.
    ///
    /// Columns: body after body in file order, `m mx my mz Ixx Ixy Ixz Iyy Iyz Izz` about the joint frame.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn regressor<S: Scalar>(&self, state: &State<'_, S>, work: &mut DynamicsWorkspace<S>, y: &mut [S]) {
        self.check(state);
        let columns = 10 * self.bodies;
        assert_eq!(y.len(), self.rates * columns, "length of the regressor");
        let gravity = self.gravity_of(state);
        y.fill(S::zero());
        match &self.follows {
            None => self.joint_regressor((state.q, state.dq, state.ddq), gravity, work, y),
            Some(follows) => {
                let mut joint_state = std::mem::take(&mut work.joint_state);
                let mut joint_y = std::mem::take(&mut work.joint_regressor);
                self.expand(state, &mut joint_state);
                let [q, dq, ddq] = &joint_state;
                self.joint_regressor((q, dq, ddq), gravity, work, &mut joint_y);
                for (row, f) in joint_y.chunks_exact(columns).zip(follows) {
                    let to = &mut y[f.coordinate * columns..][..columns];
                    for (t, v) in to.iter_mut().zip(row) {
                        *t += *v * S::from_f64(f.ratio);
                    }
                }
                work.joint_state = joint_state;
                work.joint_regressor = joint_y;
            }
        }
    }

    fn joint_regressor<S: Scalar>(
        &self,
        state: (&[S], &[S], &[S]),
        gravity: Vec3<S>,
        work: &mut DynamicsWorkspace<S>,
        y: &mut [S],
    ) {
        run_fused(RegressorTask { tree: &self.tree, slots: &self.dense_slots, state, gravity, work, y });
    }

    /// Mass matrix, row-major `n × n`: efforts of unit accelerations at rest without gravity.
    pub fn mass_matrix(&self, q: &[f64], inertias: &[f64], work: &mut DynamicsWorkspace<f64>) -> Vec<f64> {
        let n = self.rates;
        let mut mass = vec![0.0; n * n];
        let mut effort = vec![0.0; n];
        let mut ddq = vec![0.0; n];
        let dq = vec![0.0; n];
        for k in 0..n {
            ddq[k] = 1.0;
            let state = State { q, dq: &dq, ddq: &ddq, gravity: Some(Vec3::zero()) };
            self.inverse_dynamics(&state, inertias, work, &mut effort);
            for (row, e) in effort.iter().enumerate() {
                mass[row * n + k] = *e;
            }
            ddq[k] = 0.0;
        }
        mass
    }

    /// Wrench that the parent exerts on a body through its joint: force (N), then moment about the joint frame's origin
    /// (N m), in axes of the body's joint frame. Valid after [`Dynamics::inverse_dynamics`] with the same workspace.
    pub fn joint_wrench(&self, body: usize, work: &DynamicsWorkspace<f64>) -> [f64; 6] {
        let Some(index) = self.tree.nodes.iter().position(|n| n.body == body) else {
            panic!("body {body} of {}", self.bodies)
        };
        let axes = self.tree.nodes[index].axes;
        let (force, moment) = work.last_wrench(index);
        let mut wrench = [0.0; 6];
        for k in 0..3 {
            wrench[axes[k]] = force.0[k];
            wrench[3 + axes[k]] = moment.0[k];
        }
        wrench
    }
}

struct EffortTask<'a, S: Scalar> {
    tree: &'a Tree,
    state: (&'a [S], &'a [S], &'a [S]),
    gravity: Vec3<S>,
    inertias: &'a [S],
    work: &'a mut DynamicsWorkspace<S>,
    effort: &'a mut [S],
}

#[inline(always)]
fn fuse_all<S: Scalar>(from: &[S], to: &mut [S::Fused]) {
    for (t, f) in to.iter_mut().zip(from) {
        *t = f.fuse();
    }
}

impl<S: Scalar> FusedTask for EffortTask<'_, S> {
    #[inline(always)]
    fn fused(self) {
        let FusedWorkspace { inverse, state: [q, dq, ddq], effort, .. } = &mut self.work.fused;
        fuse_all(self.state.0, q);
        fuse_all(self.state.1, dq);
        fuse_all(self.state.2, ddq);
        inverse.load_inertias(self.tree, self.inertias, S::fuse);
        let gravity = Vec3(self.gravity.0.map(S::fuse));
        inverse_dynamics::sweep(self.tree, (q, dq, ddq), gravity, inverse, effort);
        for (to, from) in self.effort.iter_mut().zip(effort) {
            *to = S::unfuse(*from);
        }
    }

    fn plain(self) {
        let inverse = &mut self.work.inverse;
        inverse.load_inertias(self.tree, self.inertias, |x| x);
        inverse_dynamics::sweep(self.tree, self.state, self.gravity, inverse, self.effort);
    }
}

struct RegressorTask<'a, S: Scalar> {
    tree: &'a Tree,
    slots: &'a [usize],
    state: (&'a [S], &'a [S], &'a [S]),
    gravity: Vec3<S>,
    work: &'a mut DynamicsWorkspace<S>,
    y: &'a mut [S],
}

impl<S: Scalar> FusedTask for RegressorTask<'_, S> {
    #[inline(always)]
    fn fused(self) {
        let FusedWorkspace { regressor, state: [q, dq, ddq], .. } = &mut self.work.fused;
        fuse_all(self.state.0, q);
        fuse_all(self.state.1, dq);
        fuse_all(self.state.2, ddq);
        let gravity = Vec3(self.gravity.0.map(S::fuse));
        let y = self.y;
        regressor::sweep(
            self.tree,
            (q, dq, ddq),
            gravity,
            self.slots,
            regressor,
            |slot, columns, entries| {
                let row = &mut y[slot..slot + 10];
                for (column, entry) in columns.iter().zip(&entries) {
                    row[*column] = S::unfuse(*entry);
                }
            },
        );
    }

    fn plain(self) {
        let y = self.y;
        let regressor = &mut self.work.regressor;
        regressor::sweep(
            self.tree,
            self.state,
            self.gravity,
            self.slots,
            regressor,
            |slot, columns, entries| {
                let row = &mut y[slot..slot + 10];
                for (column, entry) in columns.iter().zip(&entries) {
                    row[*column] = *entry;
                }
            },
        );
    }
}
