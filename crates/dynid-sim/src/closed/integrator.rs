//! Integration of a closed mechanism under constant drive efforts.
//!
//! Within a step coordinates are displacements from the pose at its start, so that joints may float; accelerations are those
//! of the loops differentiated twice, and after the step the state is taken back to the closed poses
//! ([`ClosedPlant::settle`]). With error control the method is that of [`Integrator`](crate::Integrator), its matrix
//! `Zᵀ (M + hγ D + h²γ² K) Z` taken along the motions that were free at the start of the step.

use dynid_model::History;

use super::plant::{ClosedPlant, ClosedWorkspace};
use crate::error::{SimError, demand};
use crate::integrator::PlantState;
use crate::lu::Lu;
use crate::rosenbrock::{IntegrationCount, STAGES, StepControl};

/// How a [`ClosedIntegrator`] chooses its steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stepping {
    /// By the local error of a step, relative to 1 + |position| (rad, m) and to 1 + |rate|: 1e-13 to 1e-2. Safe for stiff
    /// elements.
    Controlled {
        /// Largest such error.
        tolerance: f64,
    },
    /// Equal steps of at most that size by the classical Runge-Kutta method; not for stiff elements.
    RungeKutta4 {
        /// Largest size, s.
        step: f64,
    },
}

/// Integrates a closed plant. Positions of its states are those of all joints, rates and what else is there likewise.
#[derive(Debug)]
pub struct ClosedIntegrator<'a> {
    pub(super) plant: &'a ClosedPlant,
    stepping: Stepping,
    pub(super) work: ClosedWorkspace,
    control: StepControl,
    /// Steps of equal size, and evaluations.
    steps: usize,
    pub(super) evaluations: usize,
    pub(super) start: StepStart,
    pub(super) stages: [Increment; STAGES],
    pub(super) stage: StageState,
    pub(super) acceleration: Vec<f64>,
    pub(super) next: PlantState,
}

/// What is held over a step: matrices at its start.
#[derive(Debug, Default)]
pub(super) struct StepStart {
    /// `Z`, and `Zᵀ M Z`.
    pub(super) basis: Vec<f64>,
    pub(super) reduced: Vec<f64>,
    pub(super) stiffness: Vec<f64>,
    pub(super) damping: Vec<f64>,
    /// `Zᵀ K Z`, `Zᵀ D Z`.
    pub(super) reduced_stiffness: Vec<f64>,
    pub(super) reduced_damping: Vec<f64>,
    pub(super) lu: Lu,
}

/// Increment of displacement and rates over a step as one stage sees it.
#[derive(Debug, Clone, Default)]
pub(super) struct Increment {
    pub(super) z: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) work: [f64; 2],
}

/// State at a stage.
#[derive(Debug, Clone, Default)]
pub(super) struct StageState {
    pub(super) q: Vec<f64>,
    pub(super) dq: Vec<f64>,
    /// Displacement from the start of the step, and its time derivative.
    pub(super) z: Vec<f64>,
    pub(super) dz: Vec<f64>,
}

impl<'a> ClosedIntegrator<'a> {
    /// # Errors
    /// [`SimError::Setting`] for a tolerance or step out of range.
    pub fn new(plant: &'a ClosedPlant, stepping: Stepping) -> Result<Self, SimError> {
        match stepping {
            Stepping::Controlled { tolerance } => {
                demand((1e-13..=1e-2).contains(&tolerance), "tolerance", "1e-13 to 1e-2", tolerance)?;
            }
            Stepping::RungeKutta4 { step } => {
                demand(step > 0.0 && step.is_finite(), "step", "a positive number", step)?;
            }
        }
        let (n, d) = (plant.machine.mechanism().rates(), plant.machine.mobility());
        let zeros = || vec![0.0; n];
        let positions = plant.machine.home().to_vec();
        let increment = Increment { z: zeros(), dq: zeros(), work: [0.0; 2] };
        Ok(ClosedIntegrator {
            plant,
            stepping,
            work: plant.workspace(),
            control: StepControl::default(),
            steps: 0,
            evaluations: 0,
            start: StepStart {
                stiffness: vec![0.0; n * n],
                damping: vec![0.0; n * n],
                reduced_stiffness: vec![0.0; d * d],
                reduced_damping: vec![0.0; d * d],
                ..StepStart::default()
            },
            stages: [(); STAGES].map(|()| increment.clone()),
            stage: StageState { q: positions.clone(), dq: zeros(), z: zeros(), dz: zeros() },
            acceleration: zeros(),
            next: PlantState { q: positions, dq: zeros(), ..PlantState::default() },
        })
    }

    /// Work so far.
    pub fn count(&self) -> IntegrationCount {
        let counted = self.control.count(self.evaluations);
        IntegrationCount { accepted: counted.accepted + self.steps, ..counted }
    }

    /// Memory of the plant, for use between intervals.
    pub fn workspace(&mut self) -> &mut ClosedWorkspace {
        &mut self.work
    }

    /// Moves `state` on by `duration` seconds from `time` under constant efforts of the drives and channels. The state is closed
    /// before and after.
    ///
    /// # Errors
    /// [`SimError::Forward`], [`SimError::TooFast`].
    pub fn advance(
        &mut self,
        state: &mut PlantState,
        drive: &[f64],
        channels: &[f64],
        time: f64,
        duration: f64,
    ) -> Result<(), SimError> {
        if state.history == History::default() {
            // A record starts at the steady state of its own velocity, not at that of a step's mean.
            self.plant.elements().pass(&mut state.history, duration, (&state.q, &state.dq));
        }
        match self.stepping {
            Stepping::Controlled { .. } => self.controlled(state, (drive, channels), (time, duration)),
            Stepping::RungeKutta4 { step } => {
                let steps = (duration / step * (1.0 - 1e-12)).ceil().max(1.0);
                let h = duration / steps;
                for k in 0..steps as usize {
                    let fault = |source| SimError::Forward { time: time + h * k as f64, source };
                    self.runge_kutta(state, (drive, channels), h).map_err(fault)?;
                    self.finish(state, h).map_err(fault)?;
                    std::mem::swap(state, &mut self.next);
                    self.steps += 1;
                }
                Ok(())
            }
        }
    }

    fn controlled(
        &mut self,
        state: &mut PlantState,
        (drive, channels): (&[f64], &[f64]),
        (time, duration): (f64, f64),
    ) -> Result<(), SimError> {
        let mut interval = self.control.interval(time, duration);
        while let Some(mut h) = self.control.next(&interval) {
            let time = interval.now();
            self.begin(state, (drive, channels)).map_err(|source| SimError::Forward { time, source })?;
            // What kept a trial from its end: shorter ones may reach theirs.
            let mut fault = None;
            loop {
                h = match (interval.attempt(h), fault.take()) {
                    (Err(_), Some(source)) => return Err(SimError::Forward { time, source }),
                    (h, _) => h?,
                };
                let error = self.attempt(state, (drive, channels), h).unwrap_or_else(|source| {
                    fault = Some(source);
                    f64::INFINITY
                });
                match self.control.judge(&mut interval, h, error) {
                    Some(shorter) => h = shorter,
                    None => break,
                }
            }
            std::mem::swap(state, &mut self.next);
        }
        Ok(())
    }

    fn tolerance(&self) -> f64 {
        match self.stepping {
            Stepping::Controlled { tolerance } => tolerance,
            Stepping::RungeKutta4 { .. } => f64::INFINITY,
        }
    }

    /// Error of a rate's displacement and rate in tolerances.
    pub(super) fn relative(&self, rate: usize, error_z: f64, error_v: f64) -> f64 {
        let machine = &self.plant.machine;
        // Floating joints: the displacement is all there is to compare with.
        let position = if machine.floats(rate) { 0.0 } else { self.next.q[machine.position_of(rate)] };
        let relative = |error: f64, value: f64| error.abs() / (self.tolerance() * (1.0 + value.abs()));
        relative(error_z, position).max(relative(error_v, self.next.dq[rate]))
    }
}
