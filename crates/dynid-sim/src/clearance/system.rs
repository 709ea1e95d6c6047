//! Equations of motion of a mechanism with clearance.

use dynid_model::EffortModel;
use dynid_model::element::{ClearanceContact, FrictionLine, JournalContact, JournalMotion};

use super::branch::{Branch, Sliding};
use super::settings::PrescribedMotion;
use crate::collocation::Motion;
use crate::lu::Lu;
use crate::plant::{Plant, PlantWorkspace};

/// A contact with values of its parameters.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contact<'a> {
    pub(super) element: &'a ClearanceContact,
    pub(super) parameters: [f64; 3],
}

/// What drives the driven joints.
pub(super) enum Drive<'a> {
    Prescribed(PrescribedMotion<'a>),
    /// Held efforts.
    Effort(Vec<f64>),
}

/// Mass of the free coordinates at a time, factored.
#[derive(Debug, Default)]
struct Mass {
    time: f64,
    valid: bool,
    lu: Lu,
}

/// Times whose masses are remembered: the stages of a step.
const REMEMBERED: usize = 8;

pub(super) struct System<'p, 'd> {
    plant: &'p Plant,
    work: PlantWorkspace,
    pub(super) contacts: Vec<Contact<'p>>,
    pub(super) branches: Vec<Branch>,
    /// Follow the laws themselves instead of the branches; a contact is then closed wherever it penetrates.
    pub(super) laws: bool,
    pub(super) drive: Drive<'d>,
    /// Rates that are driven.
    pub(super) driven: Vec<usize>,
    /// Rates whose motion is computed: translations, and driven joints unless they are prescribed.
    pub(super) free: Vec<usize>,
    scales: [Vec<f64>; 2],
    masses: Vec<Mass>,
    next_mass: usize,
    pub(super) q: Vec<f64>,
    pub(super) dq: Vec<f64>,
    pub(super) ddq: Vec<f64>,
    prescribed: [Vec<f64>; 3],
    pub(super) channels: Vec<f64>,
    /// Efforts of the contacts at all rates.
    contact: Vec<f64>,
}

impl<'p, 'd> System<'p, 'd> {
    pub(super) fn new(plant: &'p Plant, drive: Drive<'d>, channels: Vec<f64>, gravity: f64) -> Self {
        let n = plant.joints();
        let contacts: Vec<Contact<'_>> = plant
            .model()
            .clearance_contacts(plant.linear())
            .into_iter()
            .map(|(element, parameters)| Contact { element, parameters })
            .collect();
        let translations: Vec<usize> = contacts.iter().flat_map(|c| c.element.translations).collect();
        let driven: Vec<usize> = (0..n).filter(|rate| !plant.model().is_undriven(*rate)).collect();
        let free = match &drive {
            Drive::Prescribed(_) => translations,
            Drive::Effort(_) => (0..n).collect(),
        };
        let joints = driven.len();
        let mut system = System {
            work: plant.workspace(),
            branches: vec![Branch::Open; contacts.len()],
            laws: false,
            contacts,
            drive,
            prescribed: [(); 3].map(|()| vec![0.0; joints]),
            driven,
            scales: [vec![1.0; free.len()], vec![1.0; free.len()]],
            masses: (0..REMEMBERED).map(|_| Mass::default()).collect(),
            next_mass: 0,
            free,
            q: vec![0.0; n],
            dq: vec![0.0; n],
            ddq: vec![0.0; n],
            channels,
            contact: vec![0.0; n],
            plant,
        };
        system.set_scales(gravity);
        system
    }

    /// Positions count in clearances and in the angles that go with them, rates in what falls within a clearance.
    fn set_scales(&mut self, gravity: f64) {
        for c in &self.contacts {
            let clearance = c.element.law.clearance();
            let frequency = (gravity.max(1.0) / clearance).sqrt();
            for (k, rate) in self.free.iter().enumerate() {
                let size = if c.element.translations.contains(rate) {
                    clearance
                } else if c.element.rotation == *rate {
                    clearance / c.element.journal_radius
                } else {
                    continue;
                };
                self.scales[0][k] = size;
                self.scales[1][k] = size * frequency;
            }
        }
    }

    pub(super) fn plant(&self) -> &'p Plant {
        self.plant
    }

    pub(super) fn workspace(&mut self) -> &mut PlantWorkspace {
        &mut self.work
    }

    /// Puts the state of the free coordinates, and that of prescribed joints at a time, into `q`, `dq` and `ddq`;
    /// accelerations of free coordinates are zero.
    pub(super) fn place(&mut self, t: f64, x: &[f64], v: &[f64]) {
        if let Drive::Prescribed(motion) = &self.drive {
            let [q, dq, ddq] = &mut self.prescribed;
            motion(t, q, dq, ddq);
            for (k, rate) in self.driven.iter().enumerate() {
                (self.q[*rate], self.dq[*rate], self.ddq[*rate]) = (q[k], dq[k], ddq[k]);
            }
        }
        for (k, rate) in self.free.iter().enumerate() {
            (self.q[*rate], self.dq[*rate], self.ddq[*rate]) = (x[k], v[k], 0.0);
        }
    }

    /// Motion of a journal as it was last placed.
    pub(super) fn journal(&self, contact: usize) -> JournalMotion {
        let element = self.contacts[contact].element;
        let at = |of: &[f64]| element.translations.map(|rate| of[rate]);
        let impact_speed = match self.branches[contact] {
            Branch::Open => 0.0,
            Branch::Closed { impact_speed, .. } | Branch::Released { impact_speed } => impact_speed,
        };
        JournalMotion {
            position: at(&self.q),
            rate: at(&self.dq),
            spin: self.dq[element.rotation],
            impact_speed,
        }
    }

    fn line(&self, contact: usize) -> Option<FrictionLine> {
        match self.branches[contact] {
            Branch::Closed { sliding, .. } if !self.laws => {
                Some(sliding.line(&self.contacts[contact].element.friction))
            }
            _ => None,
        }
    }

    /// Contact as it was last placed.
    pub(super) fn contact(&self, contact: usize) -> JournalContact {
        let Contact { element, parameters } = self.contacts[contact];
        let mut found = element.contact(&self.journal(contact), parameters);
        if !self.acts(contact) {
            (found.normal_force, found.friction_force) = (0.0, 0.0);
        }
        found
    }

    /// Branch that a closed contact is on as it was last placed, with a given speed of impact.
    pub(super) fn closed(&self, contact: usize, impact_speed: f64) -> Branch {
        let Contact { element, .. } = self.contacts[contact];
        let sliding = Sliding::at(&element.friction, self.contact(contact).sliding);
        Branch::Closed { impact_speed, sliding }
    }

    /// Efforts that drives would need because of the contacts, at all rates, as last placed.
    fn form_contacts(&mut self) {
        self.contact.fill(0.0);
        for c in 0..self.contacts.len() {
            if !self.acts(c) {
                continue;
            }
            let Contact { element, parameters } = self.contacts[c];
            let efforts = element.efforts(&self.journal(c), parameters, self.line(c));
            let [x, y] = element.translations;
            for (rate, effort) in [x, y, element.rotation].into_iter().zip(efforts) {
                self.contact[rate] += effort;
            }
        }
    }

    /// Efforts of drives of the motion last placed and of accelerations `a` of the free coordinates, at all rates.
    pub(super) fn efforts(&mut self, a: &[f64]) -> Vec<f64> {
        for (k, rate) in self.free.iter().enumerate() {
            self.ddq[*rate] = a[k];
        }
        self.form_contacts();
        let motion = [&self.q[..], &self.dq[..], &self.ddq[..]];
        let mut effort = self.plant.drive_effort(motion, &self.channels, &mut self.work);
        effort.iter_mut().zip(&self.contact).for_each(|(e, c)| *e += c);
        effort
    }

    /// Efforts of other elements of the motion last given to [`System::efforts`], without their inertias' share.
    pub(super) fn element_efforts(&mut self) -> Vec<f64> {
        self.plant.element_efforts((&self.q, &self.dq), &self.channels, &mut self.work)
    }

    /// Whether a contact exerts forces.
    fn acts(&self, contact: usize) -> bool {
        self.laws || matches!(self.branches[contact], Branch::Closed { .. })
    }

    /// Whether a journal is in its bearing's surface.
    pub(super) fn is_closed(&self, contact: usize) -> bool {
        self.laws || self.branches[contact] != Branch::Open
    }

    /// Factored mass of the free coordinates as last placed, at a time.
    fn mass(&mut self, t: f64) -> Option<usize> {
        if let Some(k) = self.masses.iter().position(|m| m.valid && m.time == t) {
            return Some(k);
        }
        let (n, m) = (self.plant.joints(), self.free.len());
        let all = self.plant.mass_matrix(&self.q, &mut self.work);
        let own: Vec<f64> = (0..m * m).map(|k| all[self.free[k / m] * n + self.free[k % m]]).collect();
        let k = self.next_mass;
        self.next_mass = (k + 1) % REMEMBERED;
        let mass = &mut self.masses[k];
        mass.time = t;
        mass.valid = mass.lu.factor(m, &own);
        mass.valid.then_some(k)
    }

    /// Efforts and channels as they are held from now on; whether they are others than before.
    pub(super) fn hold(&mut self, effort: &[f64], channels: &[f64]) -> bool {
        let Drive::Effort(held) = &mut self.drive else { return false };
        let changes = held != effort || self.channels != channels;
        held.copy_from_slice(effort);
        self.channels.copy_from_slice(channels);
        changes
    }
}

impl Motion for System<'_, '_> {
    fn dimension(&self) -> usize {
        self.free.len()
    }

    fn acceleration(&mut self, t: f64, x: &[f64], v: &[f64], a: &mut [f64]) -> bool {
        self.place(t, x, v);
        self.form_contacts();
        if let Drive::Effort(held) = &self.drive {
            let mut effort: Vec<f64> = self.contact.iter().map(|c| -c).collect();
            for (rate, e) in self.driven.iter().zip(held) {
                effort[*rate] += e;
            }
            let state = (&self.q[..], &self.dq[..]);
            return self.plant.acceleration(state, &effort, &self.channels, &mut self.work, a).is_ok();
        }
        // Translations of a tree do not change the mass that belongs to them, prescribed rotations alone do.
        let Some(mass) = self.mass(t) else { return false };
        let motion = [&self.q[..], &self.dq[..], &self.ddq[..]];
        let rigid = self.plant.drive_effort(motion, &self.channels, &mut self.work);
        for (a, rate) in a.iter_mut().zip(&self.free) {
            *a = -rigid[*rate] - self.contact[*rate];
        }
        self.masses[mass].lu.solve(a);
        true
    }

    /// Of the contacts and the elements; gravity and gyroscopic forces are never stiff.
    fn jacobian(&mut self, t: f64, x: &[f64], v: &[f64], by_x: &mut [f64], by_v: &mut [f64]) {
        self.place(t, x, v);
        let (n, m) = (self.plant.joints(), self.free.len());
        let (mut stiffness, mut damping) = (vec![0.0; n * n], vec![0.0; n * n]);
        if matches!(self.drive, Drive::Effort(_)) {
            self.plant.stiffness_and_damping(
                (&self.q, &self.dq),
                &self.channels,
                &mut self.work,
                &mut stiffness,
                &mut damping,
            );
        }
        for c in 0..self.contacts.len() {
            if !self.acts(c) {
                continue;
            }
            let Contact { element, parameters } = self.contacts[c];
            let journal = self.journal(c);
            let (_, of_position, of_rate) = element.efforts_with_slopes(&journal, parameters, self.line(c));
            let [px, py] = element.translations;
            let rates = [px, py, element.rotation];
            for (row, to) in rates.into_iter().enumerate() {
                (0..2).for_each(|k| stiffness[to * n + rates[k]] += of_position[row][k]);
                (0..3).for_each(|k| damping[to * n + rates[k]] += of_rate[row][k]);
            }
        }
        let Some(mass) = self.mass(t) else { return };
        let mut column = vec![0.0; m];
        for (slopes, out) in [(&stiffness, by_x), (&damping, by_v)] {
            for k in 0..m {
                for (to, rate) in column.iter_mut().zip(&self.free) {
                    *to = -slopes[rate * n + self.free[k]];
                }
                self.masses[mass].lu.solve(&mut column);
                (0..m).for_each(|row| out[row * m + k] = column[row]);
            }
        }
    }

    fn scales(&self) -> (&[f64], &[f64]) {
        (&self.scales[0], &self.scales[1])
    }
}

/// Power of efforts, W.
pub(super) fn power(effort: &[f64], rate: &[f64]) -> f64 {
    effort.iter().zip(rate).map(|(e, v)| e * v).sum()
}
