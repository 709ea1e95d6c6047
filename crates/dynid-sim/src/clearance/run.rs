//! Running a mechanism with clearance from sample to sample.

use dynid_model::{EffortModel, JournalPath};

use super::branch::{Branch, Sliding};
use super::energy::{Powers, stored};
use super::record::{ClearanceRecord, ContactEvent, ContactEventKind, JournalRecord};
use super::system::{Drive, System};
use crate::collocation::{Attempt, Collocation, Motion, Path, STAGES};
use crate::error::{SimError, demand, demand_length};
use crate::plant::Plant;

/// Steps between two samples before a simulation gives up.
const MOST_STEPS: usize = 2_000_000;
/// First step, and first step after a contact begins or ends, s.
const FIRST_STEP: f64 = 1e-6;
/// Within how many steps of the surface of its bearing a journal is near it.
const NEAR_STEPS: f64 = 8.0;
/// Passages without progress before a simulation gives up.
const MOST_PASSAGES: usize = 64;
/// Instants of a step at which branches are looked at.
const LOOKS: u32 = 12;

/// How the equations are solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// Radau IIA of order nine with steps for a tolerance: largest local error in units of the clearances.
    Collocation {
        /// 1e-13 to 1e-3. Default: 1e-9.
        tolerance: f64,
        /// Longest step, s. Default: none.
        longest_step: f64,
    },
    /// The same with equal steps, to see its order.
    CollocationSteps {
        /// Step between located instants, s.
        step: f64,
    },
    /// The classical explicit method of order four with equal steps; nothing is located.
    RungeKutta4 {
        /// s.
        step: f64,
    },
}

impl Default for Method {
    fn default() -> Self {
        Method::Collocation { tolerance: 1e-9, longest_step: f64::INFINITY }
    }
}

/// Settings of a simulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClearanceSettings {
    /// How the equations are solved.
    pub method: Method,
    /// Values of the channels that elements read, in the order of the model's; held.
    pub channels: Vec<f64>,
}

/// A state to start from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ClearanceStart {
    /// Per joint with clearance, in the order of the model's contacts: offset of the journal's centre (m) and its rate (m/s)
    /// in axes that turn with its link. Default: all centred and at rest there.
    pub journals: Vec<([f64; 2], [f64; 2])>,
    /// Positions and rates of the driven joints, unless they are prescribed.
    pub driven: Option<(Vec<f64>, Vec<f64>)>,
}

/// Writes positions, rates and accelerations of the driven joints at a time (s) into three slices.
pub type PrescribedMotion<'a> = &'a dyn Fn(f64, &mut [f64], &mut [f64], &mut [f64]);

/// From time (s), positions and rates of the driven joints to their efforts.
pub type Controller<'a> = &'a mut dyn FnMut(f64, &[f64], &[f64], &mut [f64]);

/// What drives the driven joints, in the order of their rates.
pub enum Driving<'a> {
    /// They follow a motion exactly.
    Prescribed(PrescribedMotion<'a>),
    /// Efforts are formed every `period` from the start on, and held.
    Controlled {
        /// s.
        period: f64,
        /// Forms efforts.
        controller: Controller<'a>,
    },
}

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
    Run::new(&plant, start, driving, times, settings)?.all(times)
}

struct Run<'p, 'd> {
    system: System<'p, 'd>,
    method: Method,
    collocation: Collocation,
    controller: Option<(f64, Controller<'d>)>,
    t: f64,
    x: Vec<f64>,
    v: Vec<f64>,
    a: Vec<f64>,
    /// Step that the error control asks for, s.
    step: f64,
    /// Time of the next control instant.
    next_control: f64,
    record: ClearanceRecord,
    evaluations: usize,
    closed_time: Vec<f64>,
}

/// What says that a contact leaves its branch.
#[derive(Debug, Clone, Copy)]
enum Measure {
    Depth,
    Sliding,
    Pressing,
}

/// Where it goes.
#[derive(Debug, Clone, Copy)]
enum Next {
    Open,
    Closed,
    Released,
    Sliding(Sliding),
}

/// Past which level, and in which direction, a contact has left its branch.
struct Leaving {
    of: Measure,
    level: f64,
    sign: f64,
    to: Next,
}

/// Where a contact leaves its branch within a step.
struct Passage {
    contact: usize,
    /// Share of the step.
    tau: f64,
    to: Next,
}

impl<'p, 'd> Run<'p, 'd> {
    fn new(
        plant: &'p Plant,
        start: &ClearanceStart,
        driving: Driving<'d>,
        times: &[f64],
        settings: &ClearanceSettings,
    ) -> Result<Self, SimError> {
        check(plant, start, &driving, times, settings)?;
        let model = plant.model();
        let driven = (0..plant.joints()).filter(|rate| !model.is_undriven(*rate)).count();
        let (drive, controller) = match driving {
            Driving::Prescribed(motion) => (Drive::Prescribed(motion), None),
            Driving::Controlled { period, controller } => {
                (Drive::Effort(vec![0.0; driven]), Some((period, controller)))
            }
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
        self.system.place(self.t, &self.x, &self.v);
        let [bodies, contacts] = stored(&mut self.system);
        self.sample();
        for until in &times[1..] {
            self.advance(*until)?;
            self.sample();
        }
        self.system.place(self.t, &self.x, &self.v);
        let [bodies_end, contacts_end] = stored(&mut self.system);
        if !self.system.laws {
            self.record.energy.bodies = bodies_end - bodies;
            self.record.energy.contacts = contacts_end - contacts;
        }
        self.record.swing_hz = self.swing();
        let (evaluations, jacobians) = self.collocation.counts();
        self.record.count.evaluations = evaluations + self.evaluations;
        self.record.count.jacobians = jacobians;
        let span = (self.t - times[0]).max(f64::MIN_POSITIVE);
        for (journal, closed) in self.record.journals.iter_mut().zip(&self.closed_time) {
            journal.contact_share = closed / span;
        }
        Ok(self.record)
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
        self.system.hold(&effort);
        self.next_control += *period;
    }

    /// Acceleration at the present state.
    fn refresh(&mut self) -> Result<(), SimError> {
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

    fn advance(&mut self, until: f64) -> Result<(), SimError> {
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

    /// The first instant of the last attempt at which a contact leaves its branch. Looked for on a grid, so that a branch
    /// left and entered again within a step is not missed.
    fn first_passage(&mut self, h: f64) -> Option<Passage> {
        let n = self.x.len();
        let paths: Vec<Path> = (0..n).map(|k| self.collocation.path(k, h, self.x[k], self.v[k])).collect();
        let mut before = 0.0;
        for k in 1..=LOOKS {
            let tau = f64::from(k) / f64::from(LOOKS);
            self.place_on(&paths, h, tau);
            let left: Vec<(usize, Leaving)> =
                (0..self.system.contacts.len()).filter_map(|c| Some((c, self.leaving(c)?))).collect();
            let mut first: Option<Passage> = None;
            for (contact, leaving) in left {
                let tau = self.locate(&paths, h, (before, tau), contact, &leaving);
                if first.as_ref().is_none_or(|f| tau < f.tau) {
                    first = Some(Passage { contact, tau, to: leaving.to });
                }
            }
            if first.is_some() {
                return first;
            }
            before = tau;
        }
        None
    }

    fn place_on(&mut self, paths: &[Path], h: f64, tau: f64) {
        let (x, v): (Vec<f64>, Vec<f64>) =
            paths.iter().map(|path| path.at(tau)).map(|[x, v]| (x, v / h)).unzip();
        self.system.place(self.t + tau * h, &x, &v);
    }

    /// How a contact has left its branch, as last placed.
    fn leaving(&self, contact: usize) -> Option<Leaving> {
        let element = self.system.contacts[contact].element;
        let found = self.system.contact(contact);
        let slow = 1e-4 * element.friction.v_0.max(1e-3 * element.friction.v_m);
        let shallow = 1e-9 * element.law.clearance();
        let weak = 1e-9 * element.law.at(found.penetration, 0.0).elastic;
        let leaving = |of: Measure, level: f64, upwards: bool, to: Next| {
            Some(Leaving { of, level, sign: if upwards { 1.0 } else { -1.0 }, to })
        };
        match self.system.branches[contact] {
            Branch::Open if found.penetration > shallow => leaving(Measure::Depth, 0.0, true, Next::Closed),
            Branch::Open => None,
            _ if found.penetration < -shallow => leaving(Measure::Depth, 0.0, false, Next::Open),
            Branch::Released { .. } if found.pressing > weak => {
                leaving(Measure::Pressing, 0.0, true, Next::Closed)
            }
            Branch::Released { .. } => None,
            Branch::Closed { .. } if found.pressing < -weak => {
                leaving(Measure::Pressing, 0.0, false, Next::Released)
            }
            Branch::Closed { sliding, .. } => {
                let (low, high) = sliding.range(&element.friction);
                if found.sliding > high + slow {
                    leaving(Measure::Sliding, high, true, Next::Sliding(sliding.beyond(true)))
                } else if found.sliding < low - slow {
                    leaving(Measure::Sliding, low, false, Next::Sliding(sliding.beyond(false)))
                } else {
                    None
                }
            }
        }
    }

    /// Where between two shares of a step a contact leaves its branch, by secants and bisection; the first share if it has
    /// left it there.
    fn locate(
        &mut self,
        paths: &[Path],
        h: f64,
        (mut low, mut high): (f64, f64),
        contact: usize,
        leaving: &Leaving,
    ) -> f64 {
        let mut beyond = |tau: f64| {
            self.place_on(paths, h, tau);
            let found = self.system.contact(contact);
            let value = match leaving.of {
                Measure::Depth => found.penetration,
                Measure::Sliding => found.sliding,
                Measure::Pressing => found.pressing,
            };
            leaving.sign * (value - leaving.level)
        };
        let (mut at_low, mut at_high) = (beyond(low), beyond(high));
        if at_low >= 0.0 {
            return low;
        }
        for k in 0..200 {
            if high - low <= 1e-12 || (high - low) * h < 1e-16 {
                break;
            }
            let secant = low - at_low * (high - low) / (at_high - at_low);
            let tau = if k % 3 == 2 { 0.5 * (low + high) } else { secant.clamp(low, high) };
            let value = beyond(tau);
            if value < 0.0 {
                (low, at_low) = (tau, value);
            } else {
                (high, at_high) = (tau, value);
                if value == 0.0 {
                    break;
                }
            }
        }
        high
    }

    /// Takes a contact to its next branch at the present state.
    fn pass(&mut self, passage: &Passage, at_start: bool) -> Result<(), SimError> {
        let Passage { contact, to, .. } = *passage;
        self.system.place(self.t, &self.x, &self.v);
        let found = self.system.contact(contact);
        self.record.count.passages += 1;
        let before = self.system.branches[contact];
        let impact_speed = match before {
            Branch::Open => found.penetration_rate.abs(),
            Branch::Closed { impact_speed, .. } | Branch::Released { impact_speed } => impact_speed,
        };
        self.system.branches[contact] = match to {
            Next::Open => Branch::Open,
            Next::Closed => self.system.closed(contact, impact_speed),
            Next::Released => Branch::Released { impact_speed },
            Next::Sliding(sliding) => Branch::Closed { impact_speed, sliding },
        };
        match (before, to) {
            (Branch::Open, _) => self.event(contact, ContactEventKind::Onset(impact_speed)),
            (_, Next::Open) => self.event(contact, ContactEventKind::Loss),
            _ => {}
        }
        if !at_start {
            // Extrapolated over a kink, stages are no better than a constant.
            self.collocation.restart();
        }
        self.refresh()
    }

    fn event(&mut self, joint: usize, kind: ContactEventKind) {
        self.step = FIRST_STEP;
        self.record.events.push(ContactEvent { time: self.t, joint, kind });
    }

    /// One explicit step.
    fn explicit_step(&mut self, h: f64, end: f64) -> Result<(), SimError> {
        let n = self.x.len();
        let mut slopes: Vec<(Vec<f64>, Vec<f64>)> = Vec::with_capacity(4);
        for (k, share) in [0.0, 0.5, 0.5, 1.0].into_iter().enumerate() {
            let (mut x, mut v) = (self.x.clone(), self.v.clone());
            if k > 0 {
                let (dx, dv) = &slopes[k - 1];
                for m in 0..n {
                    x[m] += share * h * dx[m];
                    v[m] += share * h * dv[m];
                }
            }
            let mut a = vec![0.0; n];
            if !self.system.acceleration(self.t + share * h, &x, &v, &mut a) {
                return Err(SimError::TooFast { time: self.t, steps: 0 });
            }
            self.evaluations += 1;
            slopes.push((v, a));
        }
        for m in 0..n {
            let sum = |f: &dyn Fn(usize) -> f64| (f(0) + 2.0 * f(1) + 2.0 * f(2) + f(3)) / 6.0;
            self.x[m] += h * sum(&|k| slopes[k].0[m]);
            self.v[m] += h * sum(&|k| slopes[k].1[m]);
        }
        let t = self.t + h;
        self.t = if end - t <= 1e-9 * h { end } else { t };
        self.record.count.steps += 1;
        if self.x.iter().chain(&self.v).any(|x| !x.is_finite()) {
            return Err(SimError::TooFast { time: self.t, steps: self.record.count.steps });
        }
        self.system.place(self.t, &self.x, &self.v);
        for c in 0..self.system.contacts.len() {
            let found = self.system.contact(c);
            let (now, before) = (found.penetration > 0.0, self.system.branches[c] != Branch::Open);
            if now && !before {
                let speed = found.penetration_rate.abs();
                self.system.branches[c] = self.system.closed(c, speed);
                self.event(c, ContactEventKind::Onset(speed));
            } else if before && !now {
                self.system.branches[c] = Branch::Open;
                self.event(c, ContactEventKind::Loss);
            }
            self.closed_time[c] += if now { h } else { 0.0 };
            let journal = &mut self.record.journals[c];
            journal.largest_penetration = journal.largest_penetration.max(found.penetration);
            journal.largest_normal_force = journal.largest_normal_force.max(found.normal_force);
        }
        Ok(())
    }

    fn sample(&mut self) {
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

fn check(
    plant: &Plant,
    start: &ClearanceStart,
    driving: &Driving<'_>,
    times: &[f64],
    settings: &ClearanceSettings,
) -> Result<(), SimError> {
    let model = plant.model();
    let contacts = model.clearances().count();
    demand(contacts > 0, "clearance", "a joint with clearance", "none")?;
    demand_length("channels", model.channels().len(), settings.channels.len())?;
    if !start.journals.is_empty() {
        demand_length("journals", contacts, start.journals.len())?;
    }
    let numbers = start.journals.iter().flat_map(|(e, de)| e.iter().chain(de));
    let finite = numbers.clone().all(|x| x.is_finite());
    demand(finite, "journals", "finite offsets and rates", "others")?;
    let ascending = times.windows(2).all(|w| w[0] < w[1]) && times.iter().all(|t| t.is_finite());
    demand(!times.is_empty() && ascending, "times", "ascending finite times, at least one", times.len())?;
    let positive = |x: f64| x > 0.0 && x.is_finite();
    match settings.method {
        Method::Collocation { tolerance, longest_step } => {
            demand((1e-13..=1e-3).contains(&tolerance), "tolerance", "1e-13 to 1e-3", tolerance)?;
            demand(longest_step > 0.0, "longest_step", "a positive time", longest_step)?;
        }
        Method::CollocationSteps { step } | Method::RungeKutta4 { step } => {
            demand(positive(step), "step", "a positive time", step)?;
        }
    }
    let driven = (0..plant.joints()).filter(|rate| !model.is_undriven(*rate)).count();
    match driving {
        Driving::Prescribed(_) => {}
        Driving::Controlled { period, .. } => {
            demand(positive(*period), "period", "a positive time", *period)?;
            let (q, dq) = start.driven.as_ref().map_or((0, 0), |(q, dq)| (q.len(), dq.len()));
            demand_length("positions of the driven joints", driven, q)?;
            demand_length("rates of the driven joints", driven, dq)?;
        }
    }
    Ok(())
}
