//! Friction that follows reactions, among the elements.

use std::ops::Range;

use super::TreeModel;
use crate::element::ReactionFriction;

/// Such friction, and where its parameters are.
pub(crate) struct PlacedReactionFriction<'a> {
    pub(crate) element: &'a ReactionFriction,
    /// Columns of its coefficients.
    pub(crate) columns: Vec<usize>,
    /// Shape parameters of the element.
    pub(crate) shape: Range<usize>,
}

impl TreeModel {
    pub(crate) fn reaction_frictions(&self) -> impl Iterator<Item = PlacedReactionFriction<'_>> {
        self.elements.iter().filter_map(|placed| {
            Some(PlacedReactionFriction {
                element: placed.element.reaction_friction()?,
                columns: placed.entries.iter().map(|(_, column)| *column).collect(),
                shape: placed.first_shape..placed.first_shape + placed.shapes,
            })
        })
    }
}
