//! Columns of the friction of a joint along a motion, and what is none.

use std::collections::BTreeMap;

use super::TreeModel;
use crate::dynamics::MotionBlock;
use crate::element::ElementColumns;

impl TreeModel {
    /// Columns of the friction of a rate over a motion: linear parameter and values, one per sample, N m or N per unit of the
    /// parameter. Parameters ascend. Elements count that [oppose the motion](crate::element::JointElement::opposes_motion),
    /// loads of gears and changes of shape parameters included; known friction has no parameters.
    ///
    /// # Panics
    /// If there is no such rate, `shape` has the wrong length, or a channel is missing.
    pub fn friction_columns(
        &self,
        rate: usize,
        shape: &[f64],
        motion: &MotionBlock<'_>,
    ) -> Vec<(usize, Vec<f64>)> {
        self.check_shapes(shape, None);
        assert!(rate < self.joints.len(), "rate {rate} of {}", self.joints.len());
        let n = motion.samples;
        let mut columns: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
        for placed in self.elements.iter().filter(|p| p.element.opposes_motion()) {
            if placed.entries.iter().all(|(at, _)| *at != rate) {
                continue;
            }
            let mut data = vec![0.0; placed.entries.len() * n];
            let mut out =
                ElementColumns { data: &mut data, slots: &placed.entry_numbers, stride: n, samples: n };
            placed.element.fill(&self.joints, motion, placed.shape(shape), &mut out);
            for ((at, column), values) in placed.entries.iter().zip(data.chunks_exact(n.max(1))) {
                if *at == rate {
                    let sum = columns.entry(*column).or_insert_with(|| vec![0.0; n]);
                    sum.iter_mut().zip(values).for_each(|(s, x)| *s += x);
                }
            }
        }
        columns.into_iter().collect()
    }

    /// Whether the linear parameter of a name is that of an element whose effort
    /// [depends on position alone](crate::element::JointElement::is_of_position).
    pub fn is_of_position(&self, parameter: &str) -> bool {
        let Some(column) = self.parameters.linear.iter().position(|p| p.name == parameter) else {
            return false;
        };
        self.elements
            .iter()
            .filter(|placed| placed.element.is_of_position())
            .any(|placed| placed.entries.iter().any(|(_, own)| *own == column))
    }
}
