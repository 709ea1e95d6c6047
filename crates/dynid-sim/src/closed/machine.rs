//! A closed mechanism in an experiment: its drives are all that the controller and the log see.

use dynid_model::EffortModel;
use dynid_model::closed::{ClosedDynamics, PoseError};

use super::integrator::{ClosedIntegrator, Stepping};
use super::plant::{ClosedPlant, ClosedWorkspace};
use crate::controller::{ControlSettings, Nominal, Reference, Wanted};
use crate::error::{SimError, demand_length};
use crate::integrator::PlantState;
use crate::machine::{Instant, Motion};
use crate::plant::PlantEnergy;
use crate::rosenbrock::IntegrationCount;

/// Difference of wanted and possible positions of a drive, rad or m.
const TOGETHER: f64 = 1e-6;

/// A closed plant under way.
pub(crate) struct ClosedMotion<'a> {
    plant: &'a ClosedPlant,
    integrator: ClosedIntegrator<'a>,
    state: PlantState,
}

impl<'a> ClosedMotion<'a> {
    pub(crate) fn new(plant: &'a ClosedPlant, start: &[Wanted], tolerance: f64) -> Result<Self, SimError> {
        let own = independent(plant);
        let of = |k: usize| own.iter().map(|drive| start[*drive][k]).collect::<Vec<f64>>();
        let state = plant.state(&of(0), &of(1)).map_err(|source| SimError::Pose { time: 0.0, source })?;
        let integrator = ClosedIntegrator::new(plant, Stepping::Controlled { tolerance })?;
        Ok(ClosedMotion { plant, integrator, state })
    }
}

impl Motion for ClosedMotion<'_> {
    fn advance(&mut self, drive: &[f64], channels: &[f64], time: f64, duration: f64) -> Result<(), SimError> {
        self.integrator.advance(&mut self.state, drive, channels, time, duration)
    }

    fn positions(&self) -> Vec<f64> {
        self.plant.drive_positions(&self.state.q)
    }

    fn instant(&mut self, drive: &[f64], channels: &[f64], time: f64) -> Result<Instant, SimError> {
        let PlantState { q, dq, history, .. } = &self.state;
        let mut ddq = vec![0.0; dq.len()];
        let all = self.plant.elements().with_signals(channels, history, None, (q, dq));
        self.plant
            .acceleration((q, dq), drive, &all, self.integrator.workspace(), &mut ddq)
            .map_err(|source| SimError::Forward { time, source })?;
        let of = |rates: &[f64]| self.plant.machine.driven().iter().map(|r| rates[*r]).collect();
        let effort = self.plant.delivered(q, drive);
        Ok(Instant { q: self.positions(), dq: of(dq), ddq: of(&ddq), effort, sensors: Vec::new() })
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

/// A closed plant in the controller's mind, at a pose of the reference.
pub(crate) struct ClosedNominal<'a> {
    plant: &'a ClosedPlant,
    dynamics: ClosedDynamics,
    work: ClosedWorkspace,
    /// Independent coordinates, by number of the drive.
    independent: Vec<usize>,
    /// Time of the pose, and the pose at the start of the reference.
    time: f64,
    start: Option<Vec<f64>>,
    /// Shortest step along the reference, s.
    shortest: f64,
}

impl<'a> ClosedNominal<'a> {
    /// `shortest`: time within which the drives may move on the straight way between wanted positions, s.
    pub(crate) fn new(plant: &'a ClosedPlant, shortest: f64) -> Self {
        ClosedNominal {
            plant,
            dynamics: ClosedDynamics::new(plant.machine.clone()),
            work: plant.workspace(),
            independent: independent(plant),
            time: 0.0,
            start: None,
            shortest,
        }
    }

    fn reach(&mut self, wanted: &[Wanted]) -> Result<(), PoseError> {
        let positions: Vec<f64> = self.independent.iter().map(|k| wanted[*k][0]).collect();
        self.dynamics.reach(&positions)
    }

    /// To a later time: straight, or by halves of the way where the straight way is not one.
    fn go(&mut self, reference: Reference<'_>, to: f64) -> Result<(), SimError> {
        while self.time < to {
            let mut next = to;
            while let Err(source) = self.reach(&reference(next)) {
                if next - self.time <= self.shortest {
                    return Err(SimError::Pose { time: next, source });
                }
                next = self.time + 0.5 * (next - self.time);
            }
            self.time = next;
        }
        Ok(())
    }
}

impl Nominal for ClosedNominal<'_> {
    fn drives(&self) -> usize {
        self.plant.drives()
    }

    fn channels(&self) -> &[String] {
        self.plant.model().channels()
    }

    fn slides(&self) -> Vec<bool> {
        let joints = self.plant.model().tree().joints();
        self.plant.machine.driven().iter().map(|r| joints[*r].slides).collect()
    }

    fn passive(&self, settings: &ControlSettings) -> Vec<bool> {
        (0..self.drives()).map(|drive| settings.passive.contains(&drive)).collect()
    }

    fn effort_limits(&self) -> Vec<f64> {
        let tree = self.plant.model().tree();
        let limit = |r: &usize| tree.limits(*r).effort.filter(|l| *l > 0.0).unwrap_or(f64::INFINITY);
        self.plant.machine.driven().iter().map(limit).collect()
    }

    fn follow(&mut self, reference: Reference<'_>, time: f64) -> Result<Vec<Wanted>, SimError> {
        let wanted = reference(time);
        demand_length("drives of the reference", self.drives(), wanted.len())?;
        let fault = |source| SimError::Pose { time: 0.0, source };
        match self.start.clone() {
            None => {
                self.reach(&reference(0.0)).map_err(fault)?;
                self.start = Some(self.dynamics.pose().positions().to_vec());
            }
            Some(start) if time < self.time => {
                self.dynamics.take(&start).map_err(fault)?;
                self.time = 0.0;
            }
            Some(_) => {}
        }
        self.go(reference, time)?;
        let found = self.plant.drive_positions(self.dynamics.pose().positions());
        for (drive, (wanted, found)) in wanted.iter().zip(found).enumerate() {
            let gap = (wanted[0] - found).abs();
            if gap > TOGETHER || gap.is_nan() {
                let drive = self.plant.model().outputs()[drive].name.clone();
                return Err(SimError::Reference { time, drive, gap });
            }
        }
        Ok(wanted)
    }

    fn effort(&mut self, wanted: &[Wanted], channels: &[f64]) -> Result<Vec<f64>, SimError> {
        let of = |k: usize| self.independent.iter().map(|d| wanted[*d][k]).collect::<Vec<f64>>();
        let (dq, ddq) = self.dynamics.motion(&of(1), &of(2));
        let effort = self.plant.drive_effort(&mut self.dynamics, (&dq, &ddq), channels, &mut self.work);
        let fault = |source| SimError::Forward { time: self.time, source };
        Ok(effort.map_err(fault)?.drives)
    }

    /// Inertia that a drive feels with the other drives held; of an over-actuated mechanism its share along the shortest
    /// motion of the independent coordinates that moves it.
    fn largest_inertia(&mut self, reference: Reference<'_>, times: &[f64]) -> Result<Vec<f64>, SimError> {
        let mut largest = vec![0.0_f64; self.drives()];
        for time in times {
            self.follow(reference, *time)?;
            let found = self.plant.drive_inertia(&mut self.dynamics, &mut self.work);
            largest.iter_mut().zip(found).for_each(|(m, x)| *m = m.max(x));
        }
        Ok(largest)
    }
}

/// Independent coordinates, by number of the drive.
fn independent(plant: &ClosedPlant) -> Vec<usize> {
    let driven = plant.machine.driven();
    plant.machine.independent().iter().filter_map(|r| driven.iter().position(|d| d == r)).collect()
}
