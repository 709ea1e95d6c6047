//! Inverse dynamics of closed mechanisms, multipliers, and their regressors.

use std::sync::Arc;

use super::error::PoseError;
use super::factor::Factor;
use super::mechanism::ClosedMechanism;
use super::pose::PoseWorkspace;
use crate::dynamics::{Dynamics, DynamicsWorkspace, State};
use dynid_algebra::spatial::Vec3;

/// Efforts of the drives and multipliers of the closures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosedEffort {
    /// Effort of every drive, N m or N.
    pub drives: Vec<f64>,
    /// Multiplier of every condition, N or N m.
    pub multipliers: Vec<f64>,
}

/// Regressors of efforts and multipliers: `effort = W φ`, `multipliers = Λ φ`, row-major, ten columns per body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClosedRegressor {
    /// `W`, one row per drive.
    pub drives: Vec<f64>,
    /// `Λ`, one row per condition.
    pub multipliers: Vec<f64>,
}

/// Dynamics of a closed mechanism at single instants.
///
/// Over-actuated mechanisms: efforts of least norm, relative to the drives' effort limits where all of them state one.
/// Repeated conditions: multipliers of least norm, in N and N m per `L_c`.
#[derive(Clone, Debug)]
pub struct ClosedDynamics {
    machine: Arc<ClosedMechanism>,
    dynamics: Dynamics,
    work: DynamicsWorkspace<f64>,
    pub(super) pose: PoseWorkspace,
    drives: Drives,
    memory: Memory,
}

#[derive(Clone, Debug, Default)]
struct Memory {
    tree: Vec<f64>,
    dependent: Vec<f64>,
    projected: Vec<f64>,
}

/// How efforts of drives follow from efforts on independent coordinates.
#[derive(Clone, Debug)]
pub(crate) struct Drives {
    /// `None`: drives are the independent coordinates.
    shares: Option<(Factor, Vec<f64>)>,
}

impl Drives {
    pub(crate) fn new(machine: &ClosedMechanism) -> Drives {
        if machine.drives_are_independent() {
            return Drives { shares: None };
        }
        let owners = machine.mechanism.rate_bodies();
        let limit = |r: &usize| machine.mechanism.bodies()[owners[*r]].joint.limits.effort;
        let limits: Option<Vec<f64>> =
            machine.driven.iter().map(|r| limit(r).filter(|l| *l > 0.0 && l.is_finite())).collect();
        let limits = limits.unwrap_or_else(|| vec![1.0; machine.driven.len()]);
        Drives { shares: Some((Factor::default(), limits)) }
    }

    /// Takes the velocity map of a pose.
    pub(crate) fn take(&mut self, machine: &ClosedMechanism, pose: &PoseWorkspace) {
        if let Some((factor, limits)) = &mut self.shares {
            let d = machine.independent.len();
            factor.factor(limits.len(), d, |i, j| pose.map[machine.driven[i] * d + j] * limits[i]);
        }
    }

    /// Efforts of drives with the virtual work of efforts on the independent coordinates.
    pub(crate) fn share(&self, projected: &[f64], effort: &mut [f64]) {
        match &self.shares {
            None => effort.copy_from_slice(projected),
            Some((factor, limits)) => {
                factor.solve_transposed(projected, effort);
                effort.iter_mut().zip(limits).for_each(|(e, l)| *e *= l);
            }
        }
    }

    pub(crate) fn are_independent(&self) -> bool {
        self.shares.is_none()
    }
}

impl ClosedMechanism {
    /// Least-squares solutions of `J_dependent x = right` at a pose for `count` right-hand sides, row after row, as are the
    /// solutions; `right` is overwritten.
    pub(crate) fn solve_many(&self, pose: &PoseWorkspace, count: usize, right: &mut [f64], x: &mut [f64]) {
        for (b, s) in right.chunks_exact_mut(count).zip(&self.row_scale) {
            b.iter_mut().for_each(|b| *b *= s);
        }
        pose.factor.solve_many(count, right, x);
        for (x, rate) in x.chunks_exact_mut(count).zip(&self.dependent) {
            let scale = 1.0 / self.rate_scale[*rate];
            x.iter_mut().for_each(|x| *x *= scale);
        }
    }

    /// `Gᵀ t` at a pose, of efforts of all rates of the tree.
    pub(crate) fn project(&self, pose: &PoseWorkspace, tree: &[f64], out: &mut [f64]) {
        let d = self.independent.len();
        out.fill(0.0);
        for (t, row) in tree.iter().zip(pose.map.chunks_exact(d)) {
            if *t != 0.0 {
                out.iter_mut().zip(row).for_each(|(o, g)| *o += g * t);
            }
        }
    }

    /// Multipliers at a pose from efforts of the tree less those of the drives, on the dependent coordinates.
    pub(crate) fn multipliers(&self, pose: &PoseWorkspace, dependent: &mut [f64], out: &mut [f64]) {
        for (t, rate) in dependent.iter_mut().zip(&self.dependent) {
            *t /= self.rate_scale[*rate];
        }
        pose.factor.solve_transposed(dependent, out);
        out.iter_mut().zip(&self.row_scale).for_each(|(l, s)| *l *= s);
    }
}

impl ClosedDynamics {
    /// At the home position.
    pub fn new(machine: impl Into<Arc<ClosedMechanism>>) -> Self {
        let machine = machine.into();
        let dynamics = Dynamics::new(&machine.mechanism);
        let mut out = ClosedDynamics {
            work: dynamics.workspace(),
            pose: machine.workspace(),
            drives: Drives::new(&machine),
            memory: Memory::default(),
            dynamics,
            machine,
        };
        out.take_map();
        out
    }

    /// The mechanism.
    pub fn machine(&self) -> &ClosedMechanism {
        &self.machine
    }

    /// The pose.
    pub fn pose(&self) -> &PoseWorkspace {
        &self.pose
    }

    fn take_map(&mut self) {
        self.machine.map(&mut self.pose);
        self.drives.take(&self.machine, &self.pose);
    }

    /// Goes to a closed pose, given by the positions of all joints.
    ///
    /// # Errors
    /// Fails as [`ClosedMechanism::take`] does.
    pub fn take(&mut self, q: &[f64]) -> Result<(), PoseError> {
        self.machine.take(&mut self.pose, q)?;
        self.take_map();
        Ok(())
    }

    /// Goes to other positions of the independent coordinates.
    ///
    /// # Errors
    /// Fails as [`ClosedMechanism::reach`] does.
    pub fn reach(&mut self, independent: &[f64]) -> Result<(), PoseError> {
        self.machine.reach(&mut self.pose, independent)?;
        self.take_map();
        Ok(())
    }

    /// Rates and accelerations of all coordinates at the pose from those of the independent ones.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn motion(&mut self, rates: &[f64], accelerations: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let n = self.dynamics.rates();
        let (mut dq, mut ddq) = (vec![0.0; n], vec![0.0; n]);
        self.machine.motion(&mut self.pose, (rates, accelerations), &mut dq, &mut ddq);
        (dq, ddq)
    }

    /// Splits efforts of the tree (rigid bodies, and what else acts on its joints) at the pose into efforts of drives and
    /// multipliers.
    ///
    /// # Panics
    /// If `tree` does not have one entry per rate.
    pub fn split(&mut self, tree: &[f64]) -> ClosedEffort {
        let ClosedDynamics { machine, pose, drives, memory, .. } = self;
        assert_eq!(tree.len(), machine.tree.rates, "length of the efforts of the tree");
        let mut out = ClosedEffort {
            drives: vec![0.0; machine.driven.len()],
            multipliers: vec![0.0; machine.rows.len()],
        };
        split_column(machine, pose, drives, tree, memory, (&mut out.drives, &mut out.multipliers));
        out
    }

    /// Efforts and multipliers of the rigid bodies at the pose, for rates and accelerations of all coordinates as
    /// [`ClosedDynamics::motion`] gives them.
    ///
    /// `inertias`: ten standard parameters per body in file order.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn inverse_dynamics(
        &mut self,
        (dq, ddq): (&[f64], &[f64]),
        gravity: Option<Vec3<f64>>,
        inertias: &[f64],
    ) -> ClosedEffort {
        let mut tree = std::mem::take(&mut self.memory.tree);
        tree.clear();
        tree.resize(self.dynamics.rates(), 0.0);
        let state = State { q: &self.pose.q, dq, ddq, gravity };
        self.dynamics.inverse_dynamics(&state, inertias, &mut self.work, &mut tree);
        let out = self.split(&tree);
        self.memory.tree = tree;
        out
    }

    /// Regressors of efforts and multipliers at the pose.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn regressor(&mut self, (dq, ddq): (&[f64], &[f64]), gravity: Option<Vec3<f64>>) -> ClosedRegressor {
        let columns = self.dynamics.inertial_parameters();
        let mut tree = std::mem::take(&mut self.memory.tree);
        tree.clear();
        tree.resize(self.dynamics.rates() * columns, 0.0);
        let state = State { q: &self.pose.q, dq, ddq, gravity };
        self.dynamics.regressor(&state, &mut self.work, &mut tree);
        let ClosedDynamics { machine, pose, drives, memory, .. } = self;
        let (rows, conditions) = (machine.driven.len(), machine.rows.len());
        let mut out = ClosedRegressor {
            drives: vec![0.0; rows * columns],
            multipliers: vec![0.0; conditions * columns],
        };
        let mut column = vec![0.0; machine.tree.rates];
        let (mut effort, mut multipliers) = (vec![0.0; rows], vec![0.0; conditions]);
        for c in 0..columns {
            column.iter_mut().enumerate().for_each(|(k, x)| *x = tree[k * columns + c]);
            if column.iter().all(|x| *x == 0.0) {
                continue;
            }
            split_column(machine, pose, drives, &column, memory, (&mut effort, &mut multipliers));
            effort.iter().enumerate().for_each(|(k, x)| out.drives[k * columns + c] = *x);
            multipliers.iter().enumerate().for_each(|(k, x)| out.multipliers[k * columns + c] = *x);
        }
        self.memory.tree = tree;
        out
    }
}

fn split_column(
    machine: &ClosedMechanism,
    pose: &PoseWorkspace,
    drives: &Drives,
    tree: &[f64],
    memory: &mut Memory,
    (effort, multipliers): (&mut [f64], &mut [f64]),
) {
    memory.projected.resize(machine.independent.len(), 0.0);
    machine.project(pose, tree, &mut memory.projected);
    drives.share(&memory.projected, effort);
    memory.dependent.clear();
    memory.dependent.extend(machine.dependent.iter().map(|r| tree[*r]));
    if !drives.are_independent() {
        for (rate, e) in machine.driven.iter().zip(&*effort) {
            if let Ok(k) = machine.dependent.binary_search(rate) {
                memory.dependent[k] -= e;
            }
        }
    }
    machine.multipliers(pose, &mut memory.dependent, multipliers);
}
