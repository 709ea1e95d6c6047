//! A mechanism with clearance as the machine of an experiment.

use dynid_model::{EffortModel, JournalPath, journal_channels};

use super::record::ClearanceRecord;
use super::run::Run;
use super::settings::{ClearanceSettings, ClearanceStart, Offset};
use crate::controller::Wanted;
use crate::error::{SimError, demand_length};
use crate::machine::{Instant, Motion};
use crate::plant::{Plant, PlantEnergy};
use crate::rosenbrock::IntegrationCount;

/// Names of the sensors of a model with clearance, in the order of its contacts: offsets of the journals, then normal force, friction force
/// and penetration of each.
pub fn sensors(plant: &Plant) -> Vec<String> {
    let joints = || plant.model().clearances().map(|c| plant.model().joints()[c.rotation].name.as_str());
    let forces = |joint: &str| {
        ["normal_force", "friction_force", "penetration"].map(|quantity| format!("{quantity}_{joint}"))
    };
    joints().flat_map(journal_channels).chain(joints().flat_map(forces)).collect()
}

/// A mechanism with clearance under way.
pub(crate) struct ClearanceMotion<'a> {
    run: Run<'a, 'a>,
    before: [f64; 2],
}

impl<'a> ClearanceMotion<'a> {
    /// Journals begin at rest against their bearings, where the load of the start presses them. `plant`: without its contacts.
    pub(crate) fn new(plant: &'a Plant, start: &[Wanted], channels: &[f64]) -> Result<Self, SimError> {
        let driven = start.iter().map(|[q, dq, _]| (*q, *dq)).unzip();
        let start = ClearanceStart { journals: at_rest(plant, start, channels)?, driven: Some(driven) };
        let settings = ClearanceSettings { channels: channels.to_vec(), ..ClearanceSettings::default() };
        let mut run = Run::new(plant, &start, None, &[0.0], &settings)?;
        let before = run.stored();
        Ok(ClearanceMotion { run, before })
    }

    pub(crate) fn finish(self) -> ClearanceRecord {
        self.run.finish(self.before, 0.0)
    }
}

/// Offsets of the journals in axes that turn with their links, and their rates.
fn at_rest(plant: &Plant, start: &[Wanted], channels: &[f64]) -> Result<Vec<Offset>, SimError> {
    let (model, n) = (plant.model(), plant.joints());
    let driven: Vec<usize> = (0..n).filter(|rate| !model.is_undriven(*rate)).collect();
    demand_length("joints of the reference", driven.len(), start.len())?;
    let mut motion = [vec![0.0; n], vec![0.0; n], vec![0.0; n]];
    for (rate, wanted) in driven.iter().zip(start) {
        motion.iter_mut().zip(wanted).for_each(|(to, x)| to[*rate] = *x);
    }
    let [q, dq, ddq] = &motion;
    let effort = plant.drive_effort([q, dq, ddq], channels, &mut plant.workspace());
    let rest = |contact: &dynid_model::element::ClearanceContact| {
        let force = contact.translations.map(|rate| effort[rate]);
        let size = force[0].hypot(force[1]);
        if size == 0.0 {
            return ([0.0; 2], [0.0; 2]);
        }
        let length = contact.law.clearance() + contact.law.static_penetration(size);
        let path = JournalPath { position: force.map(|f| -length * f / size), ..JournalPath::default() };
        // Held in its bearing, a journal turns in the axes of its link.
        let turned = path.in_journal([q[contact.rotation], dq[contact.rotation], 0.0]);
        (turned.position, turned.rate)
    };
    Ok(model.clearances().map(rest).collect())
}

impl Motion for ClearanceMotion<'_> {
    fn advance(&mut self, drive: &[f64], channels: &[f64], time: f64, duration: f64) -> Result<(), SimError> {
        self.run.hold(drive, channels)?;
        self.run.advance(time + duration)
    }

    fn positions(&self) -> Vec<f64> {
        let system = &self.run.system;
        let place = |rate: &usize| system.free.iter().position(|free| free == rate);
        system.driven.iter().filter_map(place).map(|k| self.run.x[k]).collect()
    }

    fn instant(&mut self, drive: &[f64], channels: &[f64], _: f64) -> Result<Instant, SimError> {
        self.run.hold(drive, channels)?;
        self.run.sample();
        let record = &self.run.record;
        let of = |rows: &[Vec<f64>]| -> Vec<f64> {
            rows.last().map_or_else(Vec::new, |row| self.run.system.driven.iter().map(|r| row[*r]).collect())
        };
        let last = |of: &[f64]| of.last().copied().unwrap_or(f64::NAN);
        let offsets = record.journals.iter().flat_map(|j| j.offset.last().copied().unwrap_or_default());
        let forces = record
            .journals
            .iter()
            .flat_map(|j| [last(&j.normal_force), last(&j.friction_force), last(&j.penetration)]);
        Ok(Instant {
            q: of(&record.q),
            dq: of(&record.dq),
            ddq: of(&record.ddq),
            effort: of(&record.effort),
            sensors: offsets.chain(forces).collect(),
        })
    }

    fn energy(&mut self) -> PlantEnergy {
        self.run.system.place(self.run.t, &self.run.x, &self.run.v);
        let (q, dq) = (self.run.system.q.clone(), self.run.system.dq.clone());
        let plant = self.run.system.plant();
        plant.energy(&q, &dq, self.run.system.workspace())
    }

    /// What contacts store and lose counts as taken by elements.
    fn work(&mut self) -> [f64; 2] {
        let [_, contacts] = self.run.stored();
        let energy = &self.run.record.energy;
        let lost = energy.elements + energy.damping + energy.friction;
        [energy.drives, lost + contacts - self.before[1]]
    }

    fn count(&self) -> IntegrationCount {
        let count = self.run.record.count;
        let (evaluations, _) = self.run.collocation.counts();
        IntegrationCount {
            accepted: count.steps,
            rejected: count.repeated,
            evaluations: evaluations + self.run.evaluations,
        }
    }
}
