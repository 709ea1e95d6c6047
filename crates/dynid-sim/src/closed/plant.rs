//! The controlled mechanism with loops: rigid bodies, joint elements, torque ripple of the drives.

use std::sync::Arc;

use dynid_model::closed::{ClosedDynamics, ClosedError, ClosedMechanism, FreeMotions, PoseError};
use dynid_model::{ClosedModel, Dynamics, DynamicsWorkspace, RobotModel};

use super::loads::Loads;
use crate::elements::{ElementMemory, Elements, check_parameters};
use crate::error::SimError;
use crate::integrator::PlantState;
use crate::lu::Cholesky;
use crate::plant::{PlantEnergy, Ripple};

/// A closed mechanism as the equation of motion sees it, in the coordinates of its tree:
/// `S (drive effort + ripple) + Jᵀ λ = M(q) q̈ + h(q, q̇) + elements(q, q̇, q̈, channels)` with `J q̈ + b = 0`.
///
/// Elements act at any joint of the tree, with or without a drive. Their signs are smooth as those of a
/// [`Plant`](crate::Plant), and their effort per acceleration must not depend on the state. Joints may float; bodies may be
/// without mass as long as every free motion moves some.
#[derive(Debug)]
pub struct ClosedPlant {
    model: Arc<RobotModel>,
    /// Mechanism whose poses are followed by drives.
    pub(super) machine: Arc<ClosedMechanism>,
    pub(super) dynamics: Dynamics,
    pub(super) linear: Vec<f64>,
    shape: Vec<f64>,
    sign_width: f64,
    ripple: Vec<Ripple>,
    /// Effort of the elements per acceleration, row-major.
    pub(super) added: Vec<f64>,
    pub(super) loads: Loads,
}

/// Memory of [`ClosedPlant::acceleration`] and its kin.
#[derive(Debug, Clone)]
pub struct ClosedWorkspace {
    pub(super) free: FreeMotions,
    pub(super) dynamics: DynamicsWorkspace<f64>,
    pub(super) elements: ElementMemory,
    pub(super) rest: Vec<f64>,
    /// Accelerations that the loops ask for while no free motion accelerates.
    pub(super) drift: Vec<f64>,
    /// Efforts of bodies and added inertias at these.
    pub(super) load: Vec<f64>,
    /// Effort of elements at zero acceleration, of the last call.
    pub(super) element: Vec<f64>,
    /// Effort of drives with ripple, of the last call.
    pub(super) delivered: Vec<f64>,
    pub(super) right: Vec<f64>,
    pub(super) column: Vec<f64>,
    /// `M Z`, column after column.
    pub(super) mass_free: Vec<f64>,
    /// `Zᵀ M Z`.
    pub(super) reduced: Vec<f64>,
    pub(super) factor: Cholesky,
    /// What conditions carry, by rate: `Jᵀ λ`.
    pub(super) carried: Vec<f64>,
    /// Forces that press on joints with friction that follows them, of the last call.
    pub(super) forces: Vec<f64>,
}

impl ClosedPlant {
    /// Joins a model with its parameters.
    ///
    /// `linear`, `shape`: the model's parameters. `sign_width`: rad/s or m/s, above 0.
    ///
    /// # Errors
    /// [`SimError::NoLoops`], [`SimError::Length`], [`SimError::Setting`], [`SimError::VaryingInertia`]; [`SimError::Loops`] if the drives do not
    /// determine the pose at home.
    pub fn new(
        model: impl Into<Arc<RobotModel>>,
        linear: Vec<f64>,
        shape: Vec<f64>,
        sign_width: f64,
    ) -> Result<ClosedPlant, SimError> {
        let model = model.into();
        check_parameters(model.tree(), &linear, &shape, sign_width)?;
        let closed = model.with_reactions().ok_or(SimError::NoLoops)?;
        let machine = followed_by_drives(closed.machine())?;
        let dynamics = Dynamics::new(machine.mechanism());
        let mut plant = ClosedPlant {
            ripple: Vec::new(),
            added: Vec::new(),
            loads: Loads::new(closed, &linear),
            dynamics,
            machine,
            model,
            linear,
            shape,
            sign_width,
        };
        plant.added = plant.elements().added_inertia()?;
        Ok(plant)
    }

    /// Returns the plant with other linear parameters.
    ///
    /// # Errors
    /// Fails as [`ClosedPlant::new`] does.
    pub fn with_linear(self, linear: Vec<f64>) -> Result<ClosedPlant, SimError> {
        ClosedPlant::new(self.model, linear, self.shape, self.sign_width)
    }

    pub(super) fn elements(&self) -> Elements<'_> {
        Elements {
            model: self.model.tree(),
            linear: &self.linear,
            shape: &self.shape,
            sign_width: self.sign_width,
            without_contacts: false,
        }
    }

    /// Gives the drives their ripple, one entry per drive.
    pub(crate) fn set_ripple(&mut self, ripple: Vec<Ripple>) {
        debug_assert_eq!(ripple.len(), self.drives(), "one ripple per drive");
        self.ripple = ripple;
    }

    /// The model.
    pub fn model(&self) -> &ClosedModel {
        match self.model.with_reactions() {
            Some(closed) => closed,
            None => unreachable!("a plant of a plain tree"),
        }
    }

    /// Mechanism of the plant, whose independent coordinates are drives.
    pub fn machine(&self) -> &Arc<ClosedMechanism> {
        &self.machine
    }

    /// Linear parameters of the plant.
    pub fn linear(&self) -> &[f64] {
        &self.linear
    }

    /// Shape parameters of the plant.
    pub fn shape(&self) -> &[f64] {
        &self.shape
    }

    /// Speed over which signs of velocities are smoothed.
    pub fn sign_width(&self) -> f64 {
        self.sign_width
    }

    /// Number of drives.
    pub fn drives(&self) -> usize {
        self.machine.driven().len()
    }

    /// Position of every drive in a pose of the whole tree.
    pub(super) fn drive_positions(&self, q: &[f64]) -> Vec<f64> {
        self.machine.driven().iter().map(|r| q[self.machine.position_of(*r)]).collect()
    }

    /// Memory.
    pub fn workspace(&self) -> ClosedWorkspace {
        let (n, d) = (self.dynamics.rates(), self.machine.mobility());
        let zeros = || vec![0.0; n];
        ClosedWorkspace {
            free: self.machine.free_motions(),
            dynamics: self.dynamics.workspace(),
            elements: self.elements().memory(),
            rest: zeros(),
            drift: zeros(),
            load: zeros(),
            element: zeros(),
            delivered: vec![0.0; self.drives()],
            right: vec![0.0; d],
            column: zeros(),
            mass_free: vec![0.0; n * d],
            reduced: vec![0.0; d * d],
            factor: Cholesky::default(),
            carried: zeros(),
            forces: vec![0.0; self.loads.joints.len()],
        }
    }

    /// A closed state with given positions and rates of the [independent](ClosedMechanism::independent) drives of
    /// [`ClosedPlant::machine`], reached on the straight way from home.
    ///
    /// # Errors
    /// [`PoseError`].
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn state(&self, positions: &[f64], rates: &[f64]) -> Result<PlantState, PoseError> {
        let mut dynamics = ClosedDynamics::new(self.machine.clone());
        dynamics.reach(positions)?;
        let (dq, _) = dynamics.motion(rates, &vec![0.0; rates.len()]);
        Ok(PlantState { q: dynamics.pose().positions().to_vec(), dq, ..PlantState::default() })
    }

    /// Efforts that driven joints feel at a pose, drive effort with ripple.
    pub fn delivered(&self, q: &[f64], drive: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; drive.len()];
        self.deliver(q, drive, &mut out);
        out
    }

    pub(super) fn deliver(&self, q: &[f64], drive: &[f64], to: &mut [f64]) {
        to.copy_from_slice(drive);
        for ((e, r), rate) in to.iter_mut().zip(&self.ripple).zip(self.machine.driven()) {
            *e += r.amplitude * (r.cycles * q[self.machine.position_of(*rate)] + r.phase).sin();
        }
    }

    /// Derivatives of the elements' efforts by displacements and rates, row-major `∂elements/∂q`, `∂elements/∂q̇`. Those by
    /// positions of joints that float are left out, forces that friction follows are those of the last call.
    pub(super) fn stiffness_and_damping(
        &self,
        (q, dq): (&[f64], &[f64]),
        channels: &[f64],
        work: &mut ClosedWorkspace,
        (stiffness, damping): (&mut [f64], &mut [f64]),
    ) {
        let n = self.dynamics.rates();
        let channels = self.loads.channels(channels, &work.forces);
        let slopes = self.elements().slopes((q, dq), &channels, &mut work.elements);
        for row in 0..n {
            for k in 0..n {
                let position = self.machine.position_of(k);
                let floats = self.machine.floats(k);
                stiffness[row * n + k] = if floats { 0.0 } else { slopes.q[position * n + row] };
                damping[row * n + k] = slopes.dq[k * n + row];
            }
        }
    }

    /// Energies of a state.
    pub fn energy(&self, q: &[f64], dq: &[f64], work: &mut ClosedWorkspace) -> PlantEnergy {
        let inertias = &self.linear[..self.dynamics.inertial_parameters()];
        let bodies = self.dynamics.energy(q, dq, inertias, &mut work.dynamics);
        let mut momentum = vec![0.0; dq.len()];
        crate::lu::add_product(&mut momentum, 0.5, &self.added, dq);
        let turning: f64 = momentum.iter().zip(dq).map(|(m, v)| m * v).sum();
        PlantEnergy { kinetic: bodies.kinetic + turning, potential: bodies.potential }
    }
}

/// The mechanism with drives for independent coordinates.
fn followed_by_drives(machine: &Arc<ClosedMechanism>) -> Result<Arc<ClosedMechanism>, ClosedError> {
    if machine.independent().iter().all(|r| machine.driven().contains(r)) {
        return Ok(machine.clone());
    }
    let mechanism = machine.mechanism();
    let names = mechanism.rate_names();
    let driven: Vec<String> = machine.driven().iter().map(|r| names[*r].clone()).collect();
    let home: Vec<(String, Vec<f64>)> = mechanism
        .bodies()
        .iter()
        .map(|b| {
            (b.joint.name.clone(), machine.home()[b.position..b.position + b.joint.positions()].to_vec())
        })
        .collect();
    let closures = machine.closures().to_vec();
    let out = ClosedMechanism::new(mechanism.clone(), closures, Some(&driven), &home)?;
    Ok(Arc::new(out.with_least_measure(machine.least_measure())))
}
