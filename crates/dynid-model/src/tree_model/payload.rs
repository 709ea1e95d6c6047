//! Payloads among the elements.

use super::TreeModel;
use crate::element::Payload;

impl TreeModel {
    /// Payloads of which all ten parameters are unknown, each with the column of its mass; the other nine follow it.
    pub fn payloads(&self) -> impl Iterator<Item = (&Payload, usize)> {
        self.elements.iter().filter_map(|placed| {
            let payload = placed.element.payload().filter(|p| p.is_whole())?;
            Some((payload, placed.entries.first()?.1))
        })
    }
}
