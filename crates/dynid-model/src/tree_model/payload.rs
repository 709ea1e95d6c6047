//! Payloads and terms of single logs among the elements.

use std::ops::Range;

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

    /// Linear parameters from the first one on that acts in some logs only; a model states elements with such parameters
    /// last.
    pub fn log_columns(&self) -> Range<usize> {
        let total = self.parameters.linear.len();
        let of_logs = self.elements.iter().filter(|p| p.element.is_of_logs());
        let columns = of_logs.flat_map(|placed| placed.entries.iter().map(|(_, column)| *column));
        columns.min().unwrap_or(total)..total
    }
}
