//! How efforts of offset journals change with the motion.

use super::journals::Journals;
use super::{Journal, JournalModel};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::EffortModel;

impl JournalModel {
    /// Adds the derivatives of what offsets add to the efforts; offsets and their derivatives are held in the axes that turn with the link,
    /// those of resting journals in the bearing's.
    pub(super) fn add_offset_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        journals: &Journals,
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        let outputs = self.ideal.outputs().len();
        let own: Vec<f64> =
            (0..outputs).flat_map(|output| &weights[output * stride..][..n]).copied().collect();
        let against: Vec<f64> = own.iter().map(|w| -w).collect();
        self.still.effort_adjoint(
            motion,
            &[],
            &self.bodies_of(&self.still, &self.reference),
            n,
            &against,
            out,
        );

        let (positions, rates) = self.moving.dimensions();
        let mut all = own;
        all.resize(rates * n, 0.0);
        let mut moved = MotionAdjoint::new(positions, rates, n);
        self.moving.effort_adjoint(
            &journals.motion.block(),
            &[],
            &self.bodies_of(&self.moving, &self.reference),
            n,
            &all,
            &mut moved,
        );
        let turning = self.journals.iter().zip(&journals.probed).filter(|(_, probed)| **probed);
        turning.for_each(|(journal, _)| journal.turn(n, &journals.motion.states, &mut moved));
        let add = |to: &mut [f64], from: &[f64]| to.iter_mut().zip(from).for_each(|(to, x)| *to += x);
        add(&mut out.q, &moved.q);
        add(&mut out.dq, &moved.dq);
        add(&mut out.ddq, &moved.ddq);
    }
}

impl Journal {
    /// Adds to the derivatives by the rotation those of the translations, which turn with it: with `J` a quarter turn, `∂p/∂q = J p`,
    /// `∂ṗ/∂q = J ṗ`, `∂ṗ/∂q̇ = J p`, `∂p̈/∂q = J p̈`, `∂p̈/∂q̇ = 2 J ṗ`, `∂p̈/∂q̈ = J p`.
    fn turn(&self, n: usize, motion: &[Vec<f64>; 3], to: &mut MotionAdjoint) {
        let rate = self.contact.rotation;
        for s in 0..n {
            let pair = |of: &[f64], at: [usize; 2]| at.map(|k| of[k * n + s]);
            let places = [self.translations, self.contact.translations, self.contact.translations];
            let [p, v, a]: [[f64; 2]; 3] = std::array::from_fn(|k| pair(&motion[k], places[k]));
            let [by_p, by_v, by_a] =
                [pair(&to.q, places[0]), pair(&to.dq, places[1]), pair(&to.ddq, places[2])];
            let across = |by: [f64; 2], of: [f64; 2]| by[1] * of[0] - by[0] * of[1];
            to.q[self.rotation * n + s] += across(by_p, p) + across(by_v, v) + across(by_a, a);
            to.dq[rate * n + s] += across(by_v, p) + 2.0 * across(by_a, v);
            to.ddq[rate * n + s] += across(by_a, p);
        }
    }
}
