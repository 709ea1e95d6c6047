//! Accelerations from efforts, and efforts from accelerations.

use dynid_model::closed::{ClosedDynamics, ClosedEffort};
use dynid_model::{DynamicsWorkspace, State, Vec3};

use super::plant::{ClosedPlant, ClosedWorkspace};
use crate::error::ForwardError;
use crate::lu::add_product;

/// Share of the largest diagonal entry of the Jacobian's factors below which a motion is no longer held.
const MOBILITY: f64 = 1e-10;

impl ClosedPlant {
    /// Efforts of bodies and added inertias.
    fn body_effort(
        &self,
        [q, dq, ddq]: [&[f64]; 3],
        gravity: Option<Vec3<f64>>,
        work: &mut DynamicsWorkspace<f64>,
        to: &mut [f64],
    ) {
        let inertias = &self.linear[..self.dynamics.inertial_parameters()];
        self.dynamics.inverse_dynamics(&State { q, dq, ddq, gravity }, inertias, work, to);
        add_product(to, 1.0, &self.added, ddq);
    }

    /// Efforts of bodies alone.
    pub(super) fn rigid_effort(
        &self,
        [q, dq, ddq]: [&[f64]; 3],
        work: &mut DynamicsWorkspace<f64>,
        to: &mut [f64],
    ) {
        let inertias = &self.linear[..self.dynamics.inertial_parameters()];
        self.dynamics.inverse_dynamics(&State { q, dq, ddq, gravity: None }, inertias, work, to);
    }

    /// `M Z`, `Zᵀ M Z` and its factor, at positions that `work.free` was taken to.
    pub(super) fn reduce(&self, q: &[f64], work: &mut ClosedWorkspace) -> Result<(), ForwardError> {
        let (n, d) = (self.dynamics.rates(), self.machine.mobility());
        if work.free.regularity() < MOBILITY {
            return Err(ForwardError::Mobility);
        }
        let ClosedWorkspace { free, dynamics, rest, column, mass_free, reduced, factor, .. } = work;
        for (k, to) in mass_free.chunks_exact_mut(n).enumerate() {
            column.iter_mut().zip(free.basis().iter().skip(k).step_by(d)).for_each(|(c, z)| *c = *z);
            self.body_effort([q, rest, column], Some(Vec3::zero()), dynamics, to);
        }
        reduced.fill(0.0);
        for (k, image) in mass_free.chunks_exact(n).enumerate() {
            for (row, m) in free.basis().chunks_exact(d).zip(image) {
                row.iter().enumerate().for_each(|(other, z)| reduced[other * d + k] += z * m);
            }
        }
        factor.factor(d, reduced).map_err(|motion| {
            let moved = |r: usize| -> f64 {
                let along: f64 = motion.iter().zip(&free.basis()[r * d..]).map(|(m, z)| m * z).sum();
                (along * self.machine.rate_scales()[r]).abs()
            };
            let most = (0..n).fold(0, |m, r| if moved(r) > moved(m) { r } else { m });
            ForwardError::NoInertia { joint: self.machine.mechanism().rate_names()[most].clone() }
        })
    }

    /// Accelerations of all coordinates under given efforts of the drives (before ripple), with `channels` in the order of the
    /// model's, then its signals. The state need not be closed: accelerations then keep residuals and their rates as they are.
    ///
    /// Friction that follows reactions is settled with them, from the forces of the last call on; at the plant's own
    /// parameters, whatever reference the model has.
    ///
    /// # Errors
    /// [`ForwardError::NoInertia`], [`ForwardError::Mobility`], [`ForwardError::SelfLocking`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn acceleration(
        &self,
        (q, dq): (&[f64], &[f64]),
        drive: &[f64],
        channels: &[f64],
        work: &mut ClosedWorkspace,
        ddq: &mut [f64],
    ) -> Result<(), ForwardError> {
        self.machine.free_at(&mut work.free, q);
        self.machine.bias_at(&mut work.free, dq);
        let against: Vec<f64> = work.free.bias().iter().map(|b| -b).collect();
        work.free.shortest(&against, &mut work.drift);
        self.reduce(q, work)?;
        self.deliver(q, drive, &mut work.delivered);
        self.body_effort([q, dq, &work.drift], None, &mut work.dynamics, &mut work.load);
        if self.loads.joints.is_empty() {
            self.respond((q, dq), channels, work, ddq);
            return Ok(());
        }
        self.balance(work, |forces, work| {
            self.respond((q, dq), &self.loads.channels(channels, forces), work, ddq);
            let multipliers = self.multipliers(work);
            Ok(self.press([q, dq, ddq], &multipliers, work))
        })
    }

    /// Accelerations with known channels of the tree, where everything but the elements has been prepared.
    fn respond(
        &self,
        (q, dq): (&[f64], &[f64]),
        channels: &[f64],
        work: &mut ClosedWorkspace,
        ddq: &mut [f64],
    ) {
        let (n, d) = (self.dynamics.rates(), self.machine.mobility());
        self.elements().still_effort((q, dq), channels, &mut work.elements, &mut work.element);
        let ClosedWorkspace { free, load, element, delivered, right, carried, .. } = work;
        for (c, (l, e)) in carried.iter_mut().zip(load.iter().zip(&*element)) {
            *c = l + e;
        }
        for (rate, e) in self.machine.driven().iter().zip(&*delivered) {
            carried[*rate] -= e;
        }
        right.fill(0.0);
        for (row, c) in free.basis().chunks_exact(d).zip(&*carried) {
            right.iter_mut().zip(row).for_each(|(r, z)| *r -= z * c);
        }
        work.factor.solve(&mut work.right);
        ddq.copy_from_slice(&work.drift);
        add_product(ddq, 1.0, work.free.basis(), &work.right);
        for (image, y) in work.mass_free.chunks_exact(n).zip(&work.right) {
            work.carried.iter_mut().zip(image).for_each(|(c, m)| *c += m * y);
        }
    }

    /// Multipliers of the conditions (N, N m) at the last [`ClosedPlant::acceleration`]; of conditions that repeat each other
    /// those of least norm.
    pub fn multipliers(&self, work: &ClosedWorkspace) -> Vec<f64> {
        let mut out = vec![0.0; self.machine.conditions()];
        work.free.multipliers(&work.carried, &mut out);
        out
    }

    /// Forces that press on the joints of the model's [loads](dynid_model::ClosedModel::loads), N or N m, at the last
    /// [`ClosedPlant::acceleration`] or [`ClosedPlant::drive_effort`].
    pub fn load_forces<'w>(&self, work: &'w ClosedWorkspace) -> &'w [f64] {
        &work.forces
    }

    /// Efforts of the drives, without ripple, and multipliers of a motion of all coordinates through the pose of `dynamics`:
    /// rigid bodies and elements.
    ///
    /// # Errors
    /// [`ForwardError::SelfLocking`].
    ///
    /// # Panics
    /// If a slice has the wrong length or `dynamics` is of another mechanism.
    pub fn drive_effort(
        &self,
        dynamics: &mut ClosedDynamics,
        (dq, ddq): (&[f64], &[f64]),
        channels: &[f64],
        work: &mut ClosedWorkspace,
    ) -> Result<ClosedEffort, ForwardError> {
        let q = dynamics.pose().positions().to_vec();
        let motion = [&q[..], dq, ddq];
        let of_tree = |dynamics: &mut ClosedDynamics, channels: &[f64], work: &mut ClosedWorkspace| {
            self.rigid_effort(motion, &mut work.dynamics, &mut work.load);
            self.elements().effort(motion, channels, &mut work.elements, &mut work.element);
            work.load.iter_mut().zip(&work.element).for_each(|(l, e)| *l += e);
            dynamics.split(&work.load)
        };
        if self.loads.joints.is_empty() {
            return Ok(of_tree(dynamics, channels, work));
        }
        self.machine.free_at(&mut work.free, &q);
        let mut found = ClosedEffort::default();
        self.balance(work, |forces, work| {
            found = of_tree(dynamics, &self.loads.channels(channels, forces), work);
            Ok(self.press(motion, &found.multipliers, work))
        })?;
        Ok(found)
    }

    /// For every drive the effort that accelerates it by one at rest without gravity, along the shortest motion of the independent
    /// coordinates; elements but for their inertia do not count.
    pub(super) fn drive_inertia(
        &self,
        dynamics: &mut ClosedDynamics,
        work: &mut ClosedWorkspace,
    ) -> Vec<f64> {
        let d = self.machine.mobility();
        let mut inertia = Vec::with_capacity(self.drives());
        for (drive, rate) in self.machine.driven().iter().enumerate() {
            let row = &dynamics.pose().velocity_map()[rate * d..][..d];
            let square: f64 = row.iter().map(|g| g * g).sum();
            let along: Vec<f64> = row.iter().map(|g| if square > 0.0 { g / square } else { 0.0 }).collect();
            let (_, ddq) = dynamics.motion(&vec![0.0; d], &along);
            let state = [dynamics.pose().positions(), &work.rest, &ddq];
            self.body_effort(state, Some(Vec3::zero()), &mut work.dynamics, &mut work.load);
            inertia.push(dynamics.split(&work.load).drives[drive]);
        }
        inertia
    }
}
