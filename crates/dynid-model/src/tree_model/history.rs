//! Signals that depend on the motion before.

use rayon::prelude::*;

use super::{PlacedElement, TreeModel};
use crate::dynamics::MotionBlock;
use crate::effort_model::History;

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
            let PlacedElement { element, signals, .. } = placed;
            let rows: Vec<&mut [f64]> = rows.by_ref().take(*signals).collect();
            assert_eq!(rows.len(), *signals, "room for signals");
            (element, shape, state, rows)
        });
        let each: Vec<_> = each.collect();
        // Sample after sample, each waits for the one before: elements run beside each other.
        each.into_par_iter().for_each(|(element, shape, state, mut rows)| {
            element.remember(&self.joints, motion, step_s, shape, state, &mut rows);
        });
    }
}
