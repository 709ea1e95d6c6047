//! Where journals are over a block, and what they do there.

use super::{Journal, JournalModel};
use crate::dynamics::MotionBlock;
use crate::effort_model::EffortModel;
use crate::mechanism::JournalPath;
use crate::tree_model::TreeModel;

/// Journals over a block of samples.
pub(super) struct Journals {
    /// Motion of the robot with translations.
    pub(super) motion: Moving,
    /// Per journal: its offsets come from the motion.
    pub(super) probed: Vec<bool>,
    /// Force on each journal in bearing axes: x, y of the first, then of the next, N.
    pub(super) forces: Vec<Vec<f64>>,
    /// Per journal: moment of friction per unit of the coefficient, N m.
    pub(super) moments: Vec<Vec<f64>>,
    /// What offsets add to the efforts, `[output * samples + s]`.
    pub(super) added: Vec<f64>,
}

/// Motion of the robot with translations of the journals, packed.
pub(super) struct Moving {
    samples: usize,
    /// Positions, rates and accelerations, `[k * samples + s]`.
    pub(super) states: [Vec<f64>; 3],
    gravity: Option<Vec<f64>>,
}

impl Moving {
    pub(super) fn block(&self) -> MotionBlock<'_> {
        let [q, dq, ddq] = &self.states;
        MotionBlock { gravity: self.gravity.as_deref(), ..MotionBlock::plain(self.samples, q, dq, ddq) }
    }
}

impl JournalModel {
    pub(super) fn journals(&self, motion: &MotionBlock<'_>) -> Journals {
        self.journals_at(motion, &self.reference)
    }

    /// Journals with bodies and friction at these linear parameters.
    pub(super) fn journals_at(&self, motion: &MotionBlock<'_>, reference: &[f64]) -> Journals {
        let n = motion.samples;
        let mut moving = self.centred(motion);
        let probed: Vec<bool> =
            self.journals.iter().map(|journal| journal.follow(motion, &mut moving.states)).collect();
        if probed.contains(&false) {
            let effort = self.bodies(&self.moving, &moving.block(), reference);
            for (journal, _) in self.journals.iter().zip(&probed).filter(|(_, probed)| !**probed) {
                journal.rest(n, &effort, reference[journal.mu], &mut moving.states);
            }
        }
        let effort = self.bodies(&self.moving, &moving.block(), reference);
        let forces = self.journals.iter().flat_map(|journal| journal.contact.translations);
        let forces: Vec<Vec<f64>> = forces.map(|rate| effort[rate * n..][..n].to_vec()).collect();
        let moments = self.journals.iter().zip(forces.chunks_exact(2));
        let moments = moments
            .map(|(journal, force)| journal.moments(n, force, reference[journal.mu], &moving.states))
            .collect();
        let mut added = self.bodies(&self.still, motion, reference);
        added.iter_mut().zip(&effort).for_each(|(still, moving)| *still = moving - *still);
        Journals { motion: moving, probed, forces, moments, added }
    }

    /// Motion with translations, journals at rest in the centres of their bearings.
    fn centred(&self, motion: &MotionBlock<'_>) -> Moving {
        let n = motion.samples;
        let (positions, rates) = self.moving.dimensions();
        let (own_positions, own_rates) = self.ideal.dimensions();
        let fill = |from: &[f64], own: usize, all: usize| {
            let mut to: Vec<f64> = (0..own).flat_map(|k| &from[k * motion.stride..][..n]).copied().collect();
            to.resize(all * n, 0.0);
            to
        };
        let states = [
            fill(motion.q, own_positions, positions),
            fill(motion.dq, own_rates, rates),
            fill(motion.ddq, own_rates, rates),
        ];
        Moving { samples: n, states, gravity: motion.gravity.map(|gravity| fill(gravity, 3, 3)) }
    }

    /// Efforts of the bodies at these linear parameters, `[rate * samples + s]`.
    fn bodies(&self, model: &TreeModel, motion: &MotionBlock<'_>, reference: &[f64]) -> Vec<f64> {
        let n = motion.samples;
        let mut effort = vec![0.0; model.outputs().len() * n];
        model.efforts(motion, &[], &self.bodies_of(model, reference), n, &mut effort);
        effort
    }

    /// Inertial parameters for a model of bodies alone: carriers of journals come last and have no mass.
    pub(super) fn bodies_of(&self, model: &TreeModel, reference: &[f64]) -> Vec<f64> {
        let own = self.still.parameters().linear.len();
        let mut linear = reference[..own].to_vec();
        linear.resize(model.parameters().linear.len(), 0.0);
        linear
    }
}

impl Journal {
    /// Puts the journal where a motion says it is; false if the motion does not say.
    fn follow(&self, motion: &MotionBlock<'_>, states: &mut [Vec<f64>; 3]) -> bool {
        let n = motion.samples;
        let channels = self.offsets.each_ref().map(|pair| pair.each_ref().map(|name| motion.channel(name)));
        let [[Some(x), Some(y)], [Some(dx), Some(dy)], [Some(ddx), Some(ddy)]] = channels else {
            return false;
        };
        for s in 0..n {
            let path =
                JournalPath { position: [x[s], y[s]], rate: [dx[s], dy[s]], acceleration: [ddx[s], ddy[s]] };
            let at = |states: &[Vec<f64>; 3], k: usize, index: usize| states[k][index * n + s];
            let rate = self.contact.rotation;
            let joint = [at(states, 0, self.rotation), at(states, 1, rate), at(states, 2, rate)];
            let path = path.in_bearing(joint);
            for axis in 0..2 {
                states[0][self.translations[axis] * n + s] = path.position[axis];
                states[1][self.contact.translations[axis] * n + s] = path.rate[axis];
                states[2][self.contact.translations[axis] * n + s] = path.acceleration[axis];
            }
        }
        true
    }

    /// Lays the journal against its bearing where its load presses it. `effort`: of the bodies, journals centred.
    fn rest(&self, n: usize, effort: &[f64], mu: f64, states: &mut [Vec<f64>; 3]) {
        let gap = self.contact.law.clearance();
        for s in 0..n {
            let [x, y] = self.contact.translations.map(|rate| effort[rate * n + s]);
            let size = x.hypot(y);
            if size == 0.0 {
                continue;
            }
            let spin = states[1][self.contact.rotation * n + s];
            let rub = mu * self.contact.friction.direction(spin * self.contact.journal_radius).0;
            // n = -R(-φ) F/|F| with tan φ = rub.
            let share = gap / (size * rub.hypot(1.0));
            states[0][self.translations[0] * n + s] = -share * (x + rub * y);
            states[0][self.translations[1] * n + s] = -share * (y - rub * x);
        }
    }

    /// Moments of friction per unit of the coefficient.
    fn moments(&self, n: usize, force: &[Vec<f64>], mu: f64, states: &[Vec<f64>; 3]) -> Vec<f64> {
        let of = |s: usize| {
            let [x, y] = self.translations.map(|position| states[0][position * n + s]);
            let [dx, dy] = self.contact.translations.map(|rate| states[1][rate * n + s]);
            let spin = states[1][self.contact.rotation * n + s];
            let radius = x.hypot(y);
            // Without an offset there is no direction, nor a speed along it.
            let around = if radius > 0.0 { (x * dy - y * dx) / radius } else { 0.0 };
            let direction = self.contact.friction.direction(around + spin * self.contact.journal_radius).0;
            let load = force[0][s].hypot(force[1][s]);
            self.contact.journal_radius * direction * load / (mu * direction).hypot(1.0)
        };
        (0..n).map(of).collect()
    }
}
