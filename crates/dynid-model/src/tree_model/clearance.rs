//! Joints with clearance of a model.

use super::{PlacedElement, TreeModel};
use crate::element::ClearanceContact;

impl TreeModel {
    /// Contacts of journals in their bearings, in the order of the elements; not known ones.
    pub fn clearances(&self) -> impl Iterator<Item = &ClearanceContact> {
        self.elements.iter().filter_map(|placed| placed.element.clearance())
    }

    /// Contacts of journals with values of their parameters `[K, D, mu]`; `linear`: all linear parameters of the model.
    ///
    /// # Panics
    /// If `linear` is too short.
    pub fn clearance_contacts(&self, linear: &[f64]) -> Vec<(&ClearanceContact, [f64; 3])> {
        let values = |placed: &PlacedElement| {
            let first = placed.entries.first()?.1;
            Some([linear[first], linear[first + 1], linear[first + 2]])
        };
        self.elements
            .iter()
            .filter_map(|placed| Some((placed.element.clearance()?, values(placed)?)))
            .collect()
    }
}
