//! Signals that depend on the motion before.

use rayon::prelude::*;

use super::{PlacedElement, TreeModel};
use crate::dynamics::MotionBlock;
use crate::effort_model::History;

/// Samples from which on elements run on threads of their own: a simulation asks for one at a time, which takes less than waking a thread.
const BESIDE: usize = 1024;

/// An element, its shape parameters, what it remembers, and the rows of its signals.
type Remembering<'a> = (&'a PlacedElement, &'a [f64], &'a mut Vec<f64>, Vec<&'a mut [f64]>);

impl TreeModel {
    /// Names of the signals of all elements, those of known elements last.
    pub(super) fn signal_names(&self) -> Vec<String> {
        let elements =
            self.elements.iter().map(|p| &p.element).chain(self.known.iter().map(|k| &k.placed.element));
        let names: Vec<String> = elements.flat_map(|e| e.signals(&self.joints)).collect();
        let distinct = |k: &usize| !names[..*k].contains(&names[*k]);
        assert!((0..names.len()).all(|k| distinct(&k)), "two elements at a joint share signals: {names:?}");
        names
    }

    pub(super) fn form_signals(
        &self,
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        history: &mut History,
        stride: usize,
        out: &mut [f64],
    ) {
        self.check_shapes(shape, None);
        if self.signals.is_empty() {
            return;
        }
        assert!(step_s > 0.0 && step_s.is_finite(), "time between samples, found {step_s}");
        history.states.resize(self.elements.len() + self.known.len(), Vec::new());
        let own = self.elements.iter().map(|placed| (placed, placed.shape(shape)));
        let known = self.known.iter().map(|k| (&k.placed, k.shape.as_slice()));
        let mut rows = out.chunks_mut(stride).map(|row| &mut row[..motion.samples]);
        let remembering =
            own.chain(known).zip(&mut history.states).filter(|((placed, _), _)| placed.signals > 0);
        let each = remembering.map(|((placed, shape), state)| {
            let rows: Vec<&mut [f64]> = rows.by_ref().take(placed.signals).collect();
            assert_eq!(rows.len(), placed.signals, "room for signals");
            (placed, shape, state, rows)
        });
        let remember = |(placed, shape, state, mut rows): Remembering<'_>| {
            placed.element.remember(&self.joints, motion, step_s, shape, state, &mut rows);
        };
        if motion.samples < BESIDE {
            each.for_each(remember);
        } else {
            // Sample after sample, each waits for the one before: elements run beside each other.
            each.collect::<Vec<_>>().into_par_iter().for_each(remember);
        }
    }
}
