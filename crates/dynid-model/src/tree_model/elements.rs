//! Efforts of the elements alone, and their adjoint.

use super::{PlacedElement, TreeModel};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::{ElementColumns, ElementWeights, JointElement};

impl PlacedElement {
    pub(super) fn shape<'a>(&self, shape: &'a [f64]) -> &'a [f64] {
        &shape[self.first_shape..self.first_shape + self.shapes]
    }
}

impl TreeModel {
    /// Adds the efforts of the elements, known ones too, without those of the rigid bodies, to `effort[output * stride + s]`.
    ///
    /// `linear`: all linear parameters of the model. `memory`: scratch, of any length.
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`](crate::EffortModel::efforts) does.
    pub fn element_efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
        memory: &mut Vec<f64>,
    ) {
        self.efforts_of(|_| true, motion, (shape, linear), stride, effort, memory);
    }

    /// Efforts of some elements; known ones all count.
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`](crate::EffortModel::efforts) does.
    pub fn efforts_of(
        &self,
        counts: impl Fn(&dyn JointElement) -> bool,
        motion: &MotionBlock<'_>,
        (shape, linear): (&[f64], &[f64]),
        stride: usize,
        effort: &mut [f64],
        memory: &mut Vec<f64>,
    ) {
        self.check_shapes(shape, Some(linear));
        let n = motion.samples;
        for placed in self.elements.iter().filter(|placed| counts(placed.element.as_ref())) {
            memory.clear();
            memory.resize(placed.entries.len() * n, 0.0);
            let mut columns =
                ElementColumns { data: memory, slots: &placed.entry_numbers, stride: n, samples: n };
            placed.element.fill(&self.joints, motion, placed.shape(shape), &mut columns);
            for ((rate, column), values) in placed.entries.iter().zip(memory.chunks_exact(n.max(1))) {
                let factor = linear[*column];
                for (e, w) in effort[rate * stride..][..n].iter_mut().zip(values) {
                    *e += w * factor;
                }
            }
        }
        self.known_efforts(motion, memory, |rate, values, factor| {
            for (e, w) in effort[rate * stride..][..n].iter_mut().zip(values) {
                *e += w * factor;
            }
        });
    }

    /// Adds to `out` the derivatives of `Σ weights[output * stride + s] · effort` of the elements alone with respect to
    /// the motion; compare [`EffortModel::effort_adjoint`](crate::EffortModel::effort_adjoint).
    ///
    /// # Panics
    /// Panics as [`EffortModel::effort_adjoint`](crate::EffortModel::effort_adjoint) does.
    pub fn element_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
        memory: &mut Vec<f64>,
    ) {
        self.adjoint_of(|_| true, motion, (shape, linear), (stride, weights), out, memory);
    }

    /// Adjoint of the efforts of some elements; known ones all count.
    ///
    /// # Panics
    /// Panics as [`EffortModel::effort_adjoint`](crate::EffortModel::effort_adjoint) does.
    pub fn adjoint_of(
        &self,
        counts: impl Fn(&dyn JointElement) -> bool,
        motion: &MotionBlock<'_>,
        (shape, linear): (&[f64], &[f64]),
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
        memory: &mut Vec<f64>,
    ) {
        self.check_shapes(shape, Some(linear));
        let n = motion.samples;
        let known_weights = weights;
        for placed in self.elements.iter().filter(|placed| counts(placed.element.as_ref())) {
            memory.clear();
            for (rate, column) in &placed.entries {
                memory.extend(weights[rate * stride..][..n].iter().map(|u| u * linear[*column]));
            }
            let weights =
                ElementWeights { data: memory, slots: &placed.entry_numbers, stride: n, samples: n };
            placed.element.adjoint(&self.joints, motion, placed.shape(shape), &weights, out);
        }
        self.known_adjoint(motion, (stride, known_weights), out, memory);
    }
}
