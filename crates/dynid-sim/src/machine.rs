//! What an experiment needs of the machine that moves, and of what its controller believes it to be.

use dynid_model::EffortModel;

use crate::controller::{ControlSettings, Nominal, Reference, Wanted};
use crate::error::{SimError, demand_length};
use crate::integrator::{Integrator, PlantState};
use crate::plant::{Plant, PlantEnergy, PlantWorkspace};
use crate::rosenbrock::IntegrationCount;

/// True motion and effort of the drives at an instant.
pub(crate) struct Instant {
    pub(crate) q: Vec<f64>,
    pub(crate) dq: Vec<f64>,
    pub(crate) ddq: Vec<f64>,
    pub(crate) effort: Vec<f64>,
    /// What sensors besides encoders and drives say, in the order of the machine.
    pub(crate) sensors: Vec<f64>,
}

/// A machine under way. Its drives are all that encoders and logs see.
pub(crate) trait Motion {
    /// Moves on by `duration` seconds from `time` under constant efforts and channels.
    fn advance(&mut self, drive: &[f64], channels: &[f64], time: f64, duration: f64) -> Result<(), SimError>;
    /// Positions of the drives.
    fn positions(&self) -> Vec<f64>;
    fn instant(&mut self, drive: &[f64], channels: &[f64], time: f64) -> Result<Instant, SimError>;
    fn energy(&mut self) -> PlantEnergy;
    /// Work of the drives, and that taken by the elements, J.
    fn work(&mut self) -> [f64; 2];
    fn count(&self) -> IntegrationCount;
}

/// A plant under way.
pub(crate) struct PlantMotion<'a> {
    plant: &'a Plant,
    integrator: Integrator<'a>,
    state: PlantState,
}

impl<'a> PlantMotion<'a> {
    pub(crate) fn new(plant: &'a Plant, start: &[Wanted], tolerance: f64) -> Result<Self, SimError> {
        let state = PlantState {
            q: start.iter().map(|w| w[0]).collect(),
            dq: start.iter().map(|w| w[1]).collect(),
            ..PlantState::default()
        };
        Ok(PlantMotion { plant, integrator: Integrator::new(plant, tolerance)?, state })
    }
}

impl Motion for PlantMotion<'_> {
    fn advance(&mut self, drive: &[f64], channels: &[f64], time: f64, duration: f64) -> Result<(), SimError> {
        self.integrator.advance(&mut self.state, drive, channels, time, duration)
    }

    fn positions(&self) -> Vec<f64> {
        self.state.q.clone()
    }

    fn instant(&mut self, drive: &[f64], channels: &[f64], time: f64) -> Result<Instant, SimError> {
        let PlantState { q, dq, history, .. } = &self.state;
        let mut ddq = vec![0.0; q.len()];
        let all = self.plant.elements().with_signals(channels, history, None, (q, dq));
        self.plant
            .acceleration((q, dq), drive, &all, self.integrator.workspace(), &mut ddq)
            .map_err(|source| SimError::Inertia { time, source })?;
        let effort = self.plant.delivered(q, drive);
        Ok(Instant { q: q.clone(), dq: dq.clone(), ddq, effort, sensors: Vec::new() })
    }

    fn energy(&mut self) -> PlantEnergy {
        self.plant.energy(&self.state.q, &self.state.dq, self.integrator.workspace())
    }

    fn work(&mut self) -> [f64; 2] {
        [self.state.drive_work, self.state.element_work]
    }

    fn count(&self) -> IntegrationCount {
        self.integrator.count()
    }
}

/// A plant in the controller's mind.
pub(crate) struct PlantNominal<'a> {
    plant: &'a Plant,
    work: PlantWorkspace,
}

impl<'a> PlantNominal<'a> {
    pub(crate) fn new(plant: &'a Plant) -> Self {
        PlantNominal { plant, work: plant.workspace() }
    }
}

impl Nominal for PlantNominal<'_> {
    fn drives(&self) -> usize {
        self.plant.joints()
    }

    fn channels(&self) -> &[String] {
        self.plant.model().channels()
    }

    fn slides(&self) -> Vec<bool> {
        self.plant.model().joints().iter().map(|j| j.slides).collect()
    }

    fn passive(&self, settings: &ControlSettings) -> Vec<bool> {
        (0..self.drives()).map(|j| settings.is_passive(self.plant.model(), j)).collect()
    }

    fn effort_limits(&self) -> Vec<f64> {
        let model = self.plant.model();
        let bodies = model.mechanism().bodies();
        let owners = model.mechanism().rate_bodies();
        let limit =
            |j: usize| owners.get(j).and_then(|b| bodies[*b].joint.limits.effort).filter(|l| *l > 0.0);
        (0..self.drives()).map(|j| limit(j).unwrap_or(f64::INFINITY)).collect()
    }

    fn follow(&mut self, reference: Reference<'_>, time: f64) -> Result<Vec<Wanted>, SimError> {
        let wanted = reference(time);
        demand_length("joints of the reference", self.drives(), wanted.len())?;
        Ok(wanted)
    }

    fn effort(&mut self, wanted: &[Wanted], channels: &[f64]) -> Result<Vec<f64>, SimError> {
        let of = |k: usize| wanted.iter().map(|w| w[k]).collect::<Vec<f64>>();
        Ok(self.plant.drive_effort([&of(0), &of(1), &of(2)], channels, &mut self.work))
    }

    fn largest_inertia(&mut self, reference: Reference<'_>, times: &[f64]) -> Result<Vec<f64>, SimError> {
        let n = self.drives();
        let mut inertia = vec![0.0_f64; n];
        for time in times {
            let q: Vec<f64> = self.follow(reference, *time)?.iter().map(|w| w[0]).collect();
            let mass = self.plant.mass_matrix(&q, &mut self.work);
            inertia.iter_mut().enumerate().for_each(|(j, m)| *m = m.max(mass[j * (n + 1)]));
        }
        for motor in 0..n {
            if let Some((link, ratio)) = self.plant.model().elastic_link(motor) {
                inertia[motor] += inertia[link] / (ratio * ratio);
            }
        }
        Ok(inertia)
    }
}
