//! The controlled robot: rigid bodies, joint elements, torque ripple of the drives.

use std::sync::Arc;

use dynid_model::element::ElasticTransmission;
use dynid_model::{
    AddedInertia, Dynamics, DynamicsWorkspace, EffortModel, ForwardDynamicsWorkspace, History, LoadedState,
    NotPositive, RobotModel, State,
};

use crate::bodiless::Bodiless;
use crate::elements::{ElementMemory, Elements, check_parameters};
use crate::error::SimError;

/// Torque ripple of one drive: it delivers `effort + amplitude · sin(cycles · q + phase)`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Ripple {
    /// Amplitude, N m or N.
    pub amplitude: f64,
    /// Repetitions per turn (per `2π` metres for a joint that slides).
    pub cycles: f64,
    /// Phase, rad.
    pub phase: f64,
}

/// Energy of a plant, J.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantEnergy {
    /// Kinetic energy of bodies and added inertias.
    pub kinetic: f64,
    /// Potential energy under gravity; zero at the base origin. Springs are elements and count as their work.
    pub potential: f64,
}

/// A robot as the equation of motion sees it:
/// `drive effort + ripple(q) = M(q) q̈ + h(q, q̇) + elements(q, q̇, q̈, channels)`.
///
/// Elements take a smooth sign of velocities, `tanh(v / sign_width)`: at rest a joint creeps by at most a few widths
/// instead of sticking (bristles do stick). Their effort per acceleration must not depend on the state.
///
/// Values of channels may be followed by those of the model's signals ([`Plant::signals`]); without them elements that
/// remember are in their steady state.
///
/// Coordinates without bodies come after the joints; each needs an inertia, a [`RotorInertia`](dynid_model::element::RotorInertia)
/// above 0. Springs of elastic transmissions couple them to their links. One `sign_width` serves motors and links, though
/// motors run faster by their ratios.
#[derive(Debug)]
pub struct Plant {
    model: Arc<RobotModel>,
    dynamics: Dynamics,
    linear: Vec<f64>,
    shape: Vec<f64>,
    sign_width: f64,
    ripple: Vec<Ripple>,
    /// Effort of the elements per acceleration, row-major.
    added: Vec<f64>,
    /// What joints feel of it: the same where all rates are joints.
    at_joints: Vec<f64>,
    /// Diagonal of the inertia, if there is nothing else.
    diagonal: Option<Vec<f64>>,
    bodiless: Option<Bodiless>,
    /// Contacts of journals in their bearings are left out: somebody else adds them.
    without_contacts: bool,
}

/// Memory of [`Plant::acceleration`] and its kin.
#[derive(Debug, Clone)]
pub struct PlantWorkspace {
    forward: ForwardDynamicsWorkspace<f64>,
    dynamics: DynamicsWorkspace<f64>,
    elements: ElementMemory,
    effort: Vec<f64>,
    /// Effort of elements at zero acceleration, of the last call.
    pub(crate) element: Vec<f64>,
    /// Effort of drives with ripple, of the last call.
    pub(crate) delivered: Vec<f64>,
}

impl Plant {
    /// Joins a model with its parameters.
    ///
    /// `linear`, `shape`: the model's parameters. `sign_width`: rad/s or m/s, above 0.
    ///
    /// # Errors
    /// [`SimError::ClosedMechanism`], [`SimError::FloatingBase`], [`SimError::Length`], [`SimError::Setting`], [`SimError::VaryingInertia`],
    /// [`SimError::NoInertia`].
    pub fn new(
        model: impl Into<Arc<RobotModel>>,
        linear: Vec<f64>,
        shape: Vec<f64>,
        sign_width: f64,
    ) -> Result<Plant, SimError> {
        let model = model.into();
        if model.with_reactions().is_some() {
            return Err(SimError::ClosedMechanism);
        }
        let (positions, n) = model.dimensions();
        if positions != n {
            return Err(SimError::FloatingBase);
        }
        check_parameters(model.tree(), &linear, &shape, sign_width)?;
        let dynamics = Dynamics::new(model.mechanism());
        let mut plant = Plant {
            model,
            dynamics,
            linear,
            shape,
            sign_width,
            ripple: Vec::new(),
            added: vec![0.0; n * n],
            at_joints: Vec::new(),
            diagonal: None,
            bodiless: None,
            without_contacts: false,
        };
        plant.added = plant.elements().added_inertia()?;
        let joints = plant.dynamics.rates();
        plant.at_joints.clone_from(&plant.added);
        if joints < n {
            let (bodiless, left) = Bodiless::new(n, joints, &plant.added)
                .map_err(|rate| SimError::NoInertia { name: plant.model.joints()[rate].name.clone() })?;
            (plant.bodiless, plant.at_joints) = (Some(bodiless), left);
        }
        let off_diagonal = |k: usize| k % joints.max(1) != k / joints.max(1);
        if (0..joints * joints).all(|k| !off_diagonal(k) || plant.at_joints[k] == 0.0) {
            plant.diagonal = Some((0..joints).map(|k| plant.at_joints[k * (joints + 1)]).collect());
        }
        Ok(plant)
    }

    /// Returns the plant with other linear parameters.
    ///
    /// # Errors
    /// Fails as [`Plant::new`] does.
    pub fn with_linear(self, linear: Vec<f64>) -> Result<Plant, SimError> {
        Plant::new(self.model, linear, self.shape, self.sign_width)
    }

    /// Returns the plant without contacts of journals in their bearings, for those who add them.
    pub(crate) fn without_contacts(mut self) -> Self {
        self.without_contacts = true;
        self
    }

    pub(crate) fn elements(&self) -> Elements<'_> {
        Elements {
            model: self.model.tree(),
            linear: &self.linear,
            shape: &self.shape,
            sign_width: self.sign_width,
            without_contacts: self.without_contacts,
        }
    }

    /// Gives the drives their ripple, one entry per joint.
    pub(crate) fn set_ripple(&mut self, ripple: Vec<Ripple>) {
        debug_assert_eq!(ripple.len(), self.joints(), "one ripple per joint");
        self.ripple = ripple;
    }

    /// The model.
    pub fn model(&self) -> &RobotModel {
        &self.model
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

    /// Number of rates: joints, then coordinates without bodies.
    pub fn joints(&self) -> usize {
        self.model.joints().len()
    }

    /// Memory.
    pub fn workspace(&self) -> PlantWorkspace {
        let n = self.joints();
        PlantWorkspace {
            forward: self.dynamics.forward_workspace(),
            dynamics: self.dynamics.workspace(),
            elements: self.elements().memory(),
            effort: vec![0.0; n],
            element: vec![0.0; n],
            delivered: vec![0.0; n],
        }
    }

    /// Values of the model's signals at positions and velocities, a time `step` (s) after what `history` remembers, with velocities
    /// `between` on the way; at that instant itself without a step.
    pub fn signals(
        &self,
        history: &History,
        step: Option<(f64, &[f64])>,
        state: (&[f64], &[f64]),
    ) -> Vec<f64> {
        self.elements().signals(history, step, state)
    }

    fn inertias(&self) -> &[f64] {
        &self.linear[..self.dynamics.inertial_parameters()]
    }

    fn deliver(&self, q: &[f64], effort: &[f64], to: &mut [f64]) {
        to.copy_from_slice(effort);
        for ((e, r), q) in to.iter_mut().zip(&self.ripple).zip(q) {
            *e += r.amplitude * (r.cycles * q + r.phase).sin();
        }
    }

    /// Accelerations under given drive efforts (before ripple), with `channels` in the order of the model's, then its signals.
    ///
    /// # Errors
    /// [`NotPositive`] for a joint without inertia.
    pub fn acceleration(
        &self,
        (q, dq): (&[f64], &[f64]),
        drive: &[f64],
        channels: &[f64],
        work: &mut PlantWorkspace,
        ddq: &mut [f64],
    ) -> Result<(), NotPositive> {
        self.deliver(q, drive, &mut work.delivered);
        self.elements().still_effort((q, dq), channels, &mut work.elements, &mut work.element);
        for (e, (d, x)) in work.effort.iter_mut().zip(work.delivered.iter().zip(&work.element)) {
            *e = d - x;
        }
        if let Some(bodiless) = &self.bodiless {
            bodiless.eliminate(&mut work.effort);
        }
        let joints = self.dynamics.rates();
        let effort = &work.effort[..joints];
        let state = LoadedState { q: &q[..joints], dq: &dq[..joints], effort, gravity: None };
        let added = match &self.diagonal {
            Some(d) => AddedInertia::Diagonal(d),
            None => AddedInertia::Full(&self.at_joints),
        };
        let to = &mut ddq[..joints];
        self.dynamics.forward_dynamics(&state, self.inertias(), added, &mut work.forward, to)?;
        if let Some(bodiless) = &self.bodiless {
            bodiless.complete(&work.effort, ddq);
        }
        Ok(())
    }

    /// Effort of the drives of a motion, without ripple: rigid bodies and elements.
    pub fn drive_effort(
        &self,
        [q, dq, ddq]: [&[f64]; 3],
        channels: &[f64],
        work: &mut PlantWorkspace,
    ) -> Vec<f64> {
        let mut effort = vec![0.0; q.len()];
        let joints = self.dynamics.rates();
        let state = State { q: &q[..joints], dq: &dq[..joints], ddq: &ddq[..joints], gravity: None };
        let to = &mut effort[..joints];
        self.dynamics.inverse_dynamics(&state, self.inertias(), &mut work.dynamics, to);
        self.elements().effort([q, dq, ddq], channels, &mut work.elements, &mut work.effort);
        effort.iter_mut().zip(&work.effort).for_each(|(e, x)| *e += x);
        effort
    }

    /// Efforts of the elements at zero acceleration.
    pub(crate) fn element_efforts(
        &self,
        (q, dq): (&[f64], &[f64]),
        channels: &[f64],
        work: &mut PlantWorkspace,
    ) -> Vec<f64> {
        self.elements().still_effort((q, dq), channels, &mut work.elements, &mut work.element);
        work.element.clone()
    }

    /// Efforts that joints feel, drive effort with ripple.
    pub fn delivered(&self, q: &[f64], drive: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; q.len()];
        self.deliver(q, drive, &mut out);
        out
    }

    /// Mass matrix with the inertia of the elements, row-major.
    pub fn mass_matrix(&self, q: &[f64], work: &mut PlantWorkspace) -> Vec<f64> {
        let (n, joints) = (self.joints(), self.dynamics.rates());
        let bodies = self.dynamics.mass_matrix(&q[..joints], self.inertias(), &mut work.dynamics);
        let mut mass = self.added.clone();
        for (row, of_bodies) in mass.chunks_exact_mut(n.max(1)).zip(bodies.chunks_exact(joints.max(1))) {
            row.iter_mut().zip(of_bodies).for_each(|(m, b)| *m += b);
        }
        mass
    }

    /// Energies of a state.
    pub fn energy(&self, q: &[f64], dq: &[f64], work: &mut PlantWorkspace) -> PlantEnergy {
        let (n, joints) = (self.joints(), self.dynamics.rates());
        let inertias = self.inertias();
        let bodies = self.dynamics.energy(&q[..joints], &dq[..joints], inertias, &mut work.dynamics);
        let turning: f64 =
            (0..n).map(|i| 0.5 * dq[i] * (0..n).map(|j| self.added[i * n + j] * dq[j]).sum::<f64>()).sum();
        PlantEnergy { kinetic: bodies.kinetic + turning, potential: bodies.potential }
    }

    /// Energy stored in the springs of elastic transmissions, J; part of the work of elements.
    pub fn spring_energy(&self, q: &[f64]) -> f64 {
        let energy = |(element, values): (&ElasticTransmission, Vec<f64>)| {
            element.spring(&values).energy(q[element.motor] / element.ratio - q[element.link])
        };
        self.model.elastic_transmissions(&self.linear).into_iter().map(energy).sum()
    }

    /// Stiffness `∂elements/∂q` and damping `∂elements/∂q̇`, row-major.
    pub(crate) fn stiffness_and_damping(
        &self,
        state: (&[f64], &[f64]),
        channels: &[f64],
        work: &mut PlantWorkspace,
        stiffness: &mut [f64],
        damping: &mut [f64],
    ) {
        let n = self.joints();
        let slopes = self.elements().slopes(state, channels, &mut work.elements);
        for row in 0..n {
            for k in 0..n {
                stiffness[row * n + k] = slopes.q[k * n + row];
                damping[row * n + k] = slopes.dq[k * n + row];
            }
        }
    }
}
