//! Running a mechanism with clearance from sample to sample.

mod passage;

use dynid_model::{EffortModel, JournalPath};

use super::branch::Branch;
use super::energy::{Powers, stored};
use super::record::{ClearanceRecord, ContactEvent, ContactEventKind, JournalRecord};
use super::settings::{ClearanceSettings, ClearanceStart, Controller, Driving, Method, check};
use super::system::{Drive, System};
use crate::collocation::{Attempt, Collocation, Motion, STAGES};
use crate::error::SimError;
use crate::plant::Plant;
use passage::Passage;

/// First step after a contact begins or ends, s.
const FIRST_STEP: f64 = 1e-6;
/// Steps between two samples before a simulation gives up.
const MOST_STEPS: usize = 2_000_000;
/// Within how many steps of the surface of its bearing a journal is near it.
const NEAR_STEPS: f64 = 8.0;
/// Passages without progress before a simulation gives up.
const MOST_PASSAGES: usize = 64;

/// Simulates a mechanism with clearance from the first of some times and gives its motion at all of them.
///
/// All driven joints are prescribed, or all are controlled. `times`: ascending, s.
///
/// # Errors
/// [`SimError::Setting`], [`SimError::Length`], [`SimError::TooFast`].
pub fn simulate(
    plant: Plant,
    start: &ClearanceStart,
    driving: Driving<'_>,
    times: &[f64],
    settings: &ClearanceSettings,
) -> Result<ClearanceRecord, SimError> {
    let plant = plant.without_contacts();
    Run::new(&plant, start, Some(driving), times, settings)?.all(times)
}

pub(super) struct Run<'p, 'd> {
    pub(super) system: System<'p, 'd>,
    pub(super) method: Method,
    pub(super) collocation: Collocation,
    pub(super) controller: Option<(f64, Controller<'d>)>,
    pub(super) t: f64,
    pub(super) x: Vec<f64>,
    pub(super) v: Vec<f64>,
    pub(super) a: Vec<f64>,
    /// Step that the error control asks for, s.
    pub(super) step: f64,
    /// Time of the next control instant.
    pub(super) next_control: f64,
    pub(super) record: ClearanceRecord,
    pub(super) evaluations: usize,
    pub(super) closed_time: Vec<f64>,
}

impl<'p, 'd> Run<'p, 'd> {
    /// `driving`: `None` for efforts that are held until others are given ([`Run::hold`]).
    pub(super) fn new(
        plant: &'p Plant,
        start: &ClearanceStart,
        driving: Option<Driving<'d>>,
        times: &[f64],
        settings: &ClearanceSettings,
    ) -> Result<Self, SimError> {
        check(plant, start, driving.as_ref(), times, settings)?;
        let model = plant.model();
        let driven = (0..plant.joints()).filter(|rate| !model.is_undriven(*rate)).count();
        let (drive, controller) = match driving {
            Some(Driving::Prescribed(motion)) => (Drive::Prescribed(motion), None),
            Some(Driving::Controlled { period, controller }) => {
                (Drive::Effort(vec![0.0; driven]), Some((period, controller)))
            }
            None => (Drive::Effort(vec![0.0; driven]), None),
        };
        let gravity = model.mechanism().gravity().norm();
        let mut system = System::new(plant, drive, settings.channels.clone(), gravity);
        let explicit = matches!(settings.method, Method::RungeKutta4 { .. });
        let n = system.dimension();
        let tolerance = match settings.method {
            Method::Collocation { tolerance, .. } => tolerance,
            _ => 1e-12,
        };
        let t = times[0];
        let (mut x, mut v) = (vec![0.0; n], vec![0.0; n]);
        if let Some((q, dq)) = &start.driven {
            for (k, rate) in system.driven.iter().enumerate() {
                if let Some(place) = system.free.iter().position(|free| free == rate) {
                    (x[place], v[place]) = (q[k], dq[k]);
                }
            }
        }
        system.place(t, &x, &v);
        for c in 0..system.contacts.len() {
            let element = system.contacts[c].element;
            let (position, rate) = start.journals.get(c).copied().unwrap_or_default();
            let journal = JournalPath { position, rate, acceleration: [0.0; 2] };
            let turn = [system.q[element.rotation], system.dq[element.rotation], 0.0];
            let path = journal.in_bearing(turn);
            for (axis, rate) in element.translations.iter().enumerate() {
                if let Some(place) = system.free.iter().position(|free| free == rate) {
                    (x[place], v[place]) = (path.position[axis], path.rate[axis]);
                }
            }
        }
        system.place(t, &x, &v);
        for c in 0..system.contacts.len() {
            let found = system.contact(c);
            if found.penetration > 0.0 {
                system.branches[c] = system.closed(c, found.penetration_rate.abs());
            }
        }
        system.laws = explicit;
        let journals = system.contacts.iter().map(|c| JournalRecord {
            joint: model.joints()[c.element.rotation].name.clone(),
            ..JournalRecord::default()
        });
        let record = ClearanceRecord { journals: journals.collect(), ..ClearanceRecord::default() };
        let closed_time = vec![0.0; system.contacts.len()];
        Ok(Run {
            collocation: Collocation::new(n, tolerance),
            method: settings.method,
            controller,
            t,
            a: vec![0.0; n],
            x,
            v,
            step: FIRST_STEP,
            next_control: t,
            record,
            evaluations: 0,
            closed_time,
            system,
        })
    }

    fn all(mut self, times: &[f64]) -> Result<ClearanceRecord, SimError> {
        self.control();
        self.refresh()?;
        let before = self.stored();
        self.sample();
        for until in &times[1..] {
            self.advance(*until)?;
            self.sample();
        }
        Ok(self.finish(before, times[0]))
    }

    /// Energy of the bodies, elastic energy of the contacts.
    pub(super) fn stored(&mut self) -> [f64; 2] {
        self.system.place(self.t, &self.x, &self.v);
        stored(&mut self.system)
    }

    /// The record of a run from a time with this stored energy on.
    pub(super) fn finish(mut self, [bodies, contacts]: [f64; 2], from: f64) -> ClearanceRecord {
        let [bodies_end, contacts_end] = self.stored();
        if !self.system.laws {
            self.record.energy.bodies = bodies_end - bodies;
            self.record.energy.contacts = contacts_end - contacts;
        }
        self.record.swing_hz = self.swing();
        let (evaluations, jacobians) = self.collocation.counts();
        self.record.count.evaluations = evaluations + self.evaluations;
        self.record.count.jacobians = jacobians;
        let span = (self.t - from).max(f64::MIN_POSITIVE);
        for (journal, closed) in self.record.journals.iter_mut().zip(&self.closed_time) {
            journal.contact_share = closed / span;
        }
        self.record
    }

    /// Holds other efforts and channels from now on.
    pub(super) fn hold(&mut self, effort: &[f64], channels: &[f64]) -> Result<(), SimError> {
        if self.system.hold(effort, channels) {
            self.collocation.restart();
            self.refresh()?;
        }
        Ok(())
    }

    /// Forms efforts if a control instant has come.
    fn control(&mut self) {
        let Some((period, controller)) = &mut self.controller else { return };
        if self.t < self.next_control {
            return;
        }
        self.system.place(self.t, &self.x, &self.v);
        let driven = &self.system.driven;
        let (q, dq): (Vec<f64>, Vec<f64>) =
            driven.iter().map(|rate| (self.system.q[*rate], self.system.dq[*rate])).unzip();
        let mut effort = vec![0.0; driven.len()];
        controller(self.t, &q, &dq, &mut effort);
        let channels = self.system.channels.clone();
        self.system.hold(&effort, &channels);
        self.next_control += *period;
    }

    /// Acceleration at the present state.
    pub(super) fn refresh(&mut self) -> Result<(), SimError> {
        let mut a = std::mem::take(&mut self.a);
        let ok = self.system.acceleration(self.t, &self.x, &self.v, &mut a);
        self.evaluations += 1;
        self.a = a;
        if ok && self.a.iter().all(|a| a.is_finite()) {
            Ok(())
        } else {
            Err(SimError::TooFast { time: self.t, steps: 0 })
        }
    }

    pub(super) fn advance(&mut self, until: f64) -> Result<(), SimError> {
        let mut steps = 0;
        while self.t < until {
            let held = if self.controller.is_some() { self.next_control } else { f64::INFINITY };
            let end = until.min(held);
            while self.t < end {
                steps += 1;
                if steps > MOST_STEPS {
                    return Err(SimError::TooFast { time: self.t, steps });
                }
                match self.method {
                    Method::RungeKutta4 { step } => self.explicit_step(step.min(end - self.t), end)?,
                    _ => self.step(end)?,
                }
            }
            if self.controller.is_some() && self.t >= self.next_control {
                self.control();
                self.collocation.restart();
                self.refresh()?;
            }
        }
        Ok(())
    }

    /// One step with collocation, not beyond `end`.
    fn step(&mut self, end: f64) -> Result<(), SimError> {
        let left = end - self.t;
        let equal = matches!(self.method, Method::CollocationSteps { .. });
        let longest = match self.method {
            Method::Collocation { longest_step, .. } => longest_step,
            Method::CollocationSteps { step } | Method::RungeKutta4 { step } => step,
        };
        let mut h = self.step.min(longest);
        if equal {
            h = longest;
        }
        // Two equal last steps rather than a long and a short one.
        h = if h >= 0.999 * left {
            left
        } else if h > 0.55 * left {
            0.5 * left
        } else {
            h
        };
        self.collocation.linearise(&mut self.system, self.t, &self.x, &self.v);
        // The step was shortened to end at this one.
        let mut located: Option<Passage> = None;
        let mut passed = false;
        for _ in 0..MOST_PASSAGES {
            // Forces grow from nothing as no polynomial does.
            let rough = self.near_the_surface(h);
            self.collocation.set_rough(rough);
            let start = (&self.x[..], &self.v[..], &self.a[..]);
            let error = match self.collocation.attempt(&mut self.system, (self.t, h), start) {
                Attempt::Solved(error) => error,
                Attempt::Diverged => f64::INFINITY,
            };
            if !(error <= 1.0 || (equal && error.is_finite())) {
                self.record.count.repeated += 1;
                let factor = 0.9 * error.powf(-1.0 / Collocation::ERROR_ORDER);
                h *= if factor.is_finite() { factor.clamp(0.1, 0.8) } else { 0.25 };
                self.step = h;
                located = None;
                if h < 1e-15 * (1.0 + self.t.abs()) {
                    return Err(SimError::TooFast { time: self.t, steps: 0 });
                }
                continue;
            }
            let growth = (0.9 * error.max(1e-12).powf(-1.0 / Collocation::ERROR_ORDER)).clamp(0.2, 4.0);
            match self.first_passage(h) {
                // Close enough to the end of the step, or to its start.
                Some(passage) if passage.tau * h < 1e-13 => {
                    // One that enters a branch and leaves it again at once must be looked at more closely.
                    if passed {
                        h *= 0.25;
                    }
                    passed = true;
                    self.pass(&passage, true)?;
                    self.collocation.linearise(&mut self.system, self.t, &self.x, &self.v);
                }
                Some(passage) if passage.tau < 1.0 - 1e-9 => {
                    h *= passage.tau;
                    located = Some(passage);
                    self.record.count.repeated += 1;
                }
                passage => {
                    let passage = passage.or(located);
                    // A step cut short by the end says nothing against the longer one.
                    self.step = if h < self.step { self.step.max(h * growth) } else { h * growth };
                    self.accept(h, end);
                    if let Some(passage) = passage {
                        self.pass(&passage, false)?;
                    }
                    return Ok(());
                }
            }
        }
        Err(SimError::TooFast { time: self.t, steps: MOST_PASSAGES })
    }

    /// Whether a closed contact has just begun or is about to end, at its present speed.
    fn near_the_surface(&mut self, h: f64) -> bool {
        self.system.place(self.t, &self.x, &self.v);
        (0..self.system.contacts.len()).any(|c| {
            let found = self.system.contact(c);
            self.system.is_closed(c) && found.penetration < NEAR_STEPS * h * found.penetration_rate.abs()
        })
    }

    pub(super) fn event(&mut self, joint: usize, kind: ContactEventKind) {
        self.step = FIRST_STEP;
        self.record.events.push(ContactEvent { time: self.t, joint, kind });
    }

    fn accept(&mut self, h: f64, end: f64) {
        self.add_energy(h);
        self.collocation.keep(h);
        self.collocation.end(h, &mut self.x, &mut self.v, &mut self.a);
        for (time, branch) in self.closed_time.iter_mut().zip(&self.system.branches) {
            *time += if *branch == Branch::Open { 0.0 } else { h };
        }
        let t = self.t + h;
        self.t = if end - t <= 1e-12 * (1.0 + end.abs()) { end } else { t };
        self.record.count.steps += 1;
    }

    fn add_energy(&mut self, h: f64) {
        let weights = *self.collocation.method().weights();
        let nodes = self.collocation.method().c;
        let n = self.x.len();
        let (t, x, v) = (self.t, self.x.clone(), self.v.clone());
        for i in 0..STAGES {
            let a = self.collocation.stages()[i * n..(i + 1) * n].to_vec();
            let (stage_x, stage_v) = self.collocation.stage(i, h, &x, &v);
            self.system.place(t + nodes[i] * h, stage_x, stage_v);
            Powers::of(&mut self.system, &a).add_to(&mut self.record.energy, h * weights[i]);
            for (c, journal) in self.record.journals.iter_mut().enumerate() {
                let found = self.system.contact(c);
                journal.largest_penetration = journal.largest_penetration.max(found.penetration);
                journal.largest_normal_force = journal.largest_normal_force.max(found.normal_force);
            }
        }
    }

    pub(super) fn sample(&mut self) {
        let mut a = vec![0.0; self.x.len()];
        // A true right-hand side, where collocation has converged to one.
        self.system.acceleration(self.t, &self.x, &self.v, &mut a);
        let effort = self.system.efforts(&a);
        let record = &mut self.record;
        record.time.push(self.t);
        record.q.push(self.system.q.clone());
        record.dq.push(self.system.dq.clone());
        record.ddq.push(self.system.ddq.clone());
        record.effort.push(effort);
        for (c, journal) in record.journals.iter_mut().enumerate() {
            let element = self.system.contacts[c].element;
            let at = |of: &[f64]| element.translations.map(|rate| of[rate]);
            let bearing = JournalPath {
                position: at(&self.system.q),
                rate: at(&self.system.dq),
                acceleration: at(&self.system.ddq),
            };
            let joint = element.rotation;
            let turn = [self.system.q[joint], self.system.dq[joint], self.system.ddq[joint]];
            let path = bearing.in_journal(turn);
            let found = self.system.contact(c);
            journal.offset.push(path.position);
            journal.offset_rate.push(path.rate);
            journal.offset_acceleration.push(path.acceleration);
            journal.penetration.push(found.penetration);
            journal.sliding.push(found.sliding);
            journal.normal_force.push(found.normal_force);
            journal.friction_force.push(found.friction_force);
            journal.friction_moment.push(-found.friction_force * element.journal_radius);
        }
    }

    /// Fastest swing of a closed contact's journal: the root of the stiffness along the tangent over the mass it moves.
    fn swing(&mut self) -> f64 {
        let m = self.x.len();
        let (mut by_x, mut by_v) = (vec![0.0; m * m], vec![0.0; m * m]);
        self.system.jacobian(self.t, &self.x, &self.v, &mut by_x, &mut by_v);
        let mut fastest = 0.0_f64;
        for c in 0..self.system.contacts.len() {
            if !self.system.is_closed(c) {
                continue;
            }
            let found = self.system.contact(c);
            let across = [-found.normal[1], found.normal[0]];
            let places = self.system.contacts[c]
                .element
                .translations
                .map(|rate| self.system.free.iter().position(|free| *free == rate).unwrap_or(0));
            let stiffness: f64 = (0..2)
                .flat_map(|i| (0..2).map(move |j| (i, j)))
                .map(|(i, j)| -across[i] * by_x[places[i] * m + places[j]] * across[j])
                .sum();
            fastest = fastest.max(stiffness.max(0.0).sqrt() / std::f64::consts::TAU);
        }
        fastest
    }
}
