//! Friction that follows reactions, among the elements.

use std::ops::Range;

use super::TreeModel;
use crate::element::FollowingFriction;

/// Such friction, and where its parameters are.
pub(crate) struct PlacedReactionFriction<'a> {
    pub(crate) element: FollowingFriction<'a>,
    /// Columns of its coefficients.
    pub(crate) columns: Vec<usize>,
    /// Shape parameters of the element.
    shape: Range<usize>,
}

impl PlacedReactionFriction<'_> {
    /// Rate that it acts on.
    pub(crate) fn rate(&self) -> usize {
        self.element.law.law.rate
    }

    /// Its shape parameters, of those of the model where it does not hold them.
    pub(crate) fn shape<'s>(&'s self, model: &'s [f64]) -> &'s [f64] {
        self.element.held.unwrap_or_else(|| &model[self.shape.clone()])
    }
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
