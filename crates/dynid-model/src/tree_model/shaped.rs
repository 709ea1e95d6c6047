//! The columns that change with shape parameters, without the rest of the regressor.

use super::{PlacedElement, TreeModel};
use crate::dynamics::MotionBlock;
use crate::element::ElementColumns;

/// Places of the shaped columns and of their derivatives.
#[derive(Debug)]
pub(super) struct Shaped {
    /// `(output, linear column)`, ascending.
    pub(super) columns: Vec<(usize, usize)>,
    /// `(shaped column, shape parameter)`.
    pub(super) dependence: Vec<(usize, usize)>,
    /// Elements that fill them.
    elements: Vec<ShapedElement>,
}

#[derive(Debug)]
struct ShapedElement {
    /// Index among the model's elements.
    element: usize,
    /// For every entry: its shaped column, if it is one.
    columns: Vec<Option<usize>>,
    /// Shaped columns without gaps, where every entry is shaped: the element then fills its columns in place.
    in_place: Option<Vec<usize>>,
    /// For every pair of the element: its place among the dependences.
    derivatives: Vec<usize>,
}

impl Shaped {
    pub(super) fn new(elements: &[PlacedElement]) -> Self {
        let pairs: Vec<Vec<(usize, usize)>> = elements.iter().map(|p| p.element.shape_entries()).collect();
        let mut columns: Vec<(usize, usize)> = elements
            .iter()
            .zip(&pairs)
            .flat_map(|(placed, pairs)| pairs.iter().map(|(entry, _)| placed.entries[*entry]))
            .collect();
        columns.sort_unstable();
        columns.dedup();
        let mut dependence = Vec::new();
        let mut shaped = Vec::new();
        for (element, (placed, pairs)) in elements.iter().zip(&pairs).enumerate() {
            if pairs.is_empty() {
                continue;
            }
            let of_entry: Vec<Option<usize>> =
                placed.entries.iter().map(|e| columns.binary_search(e).ok()).collect();
            let first = dependence.len();
            for (entry, parameter) in pairs {
                dependence.extend(of_entry[*entry].map(|column| (column, placed.first_shape + parameter)));
            }
            shaped.push(ShapedElement {
                element,
                in_place: of_entry.iter().copied().collect(),
                columns: of_entry,
                derivatives: (first..dependence.len()).collect(),
            });
        }
        Shaped { columns, dependence, elements: shaped }
    }
}

impl TreeModel {
    pub(super) fn fill_shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        self.check_shapes(shape, None);
        let samples = motion.samples;
        let (wants_values, wants_derivatives) = (!values.is_empty(), !derivatives.is_empty());
        for shaped in &self.shaped.elements {
            let placed = &self.elements[shaped.element];
            let (element, own_shape) = (&placed.element, placed.shape(shape));
            let mut slopes =
                ElementColumns { data: &mut *derivatives, slots: &shaped.derivatives, stride, samples };
            if let (true, Some(slots)) = (wants_values, &shaped.in_place) {
                let mut out = ElementColumns { data: &mut *values, slots, stride, samples };
                if wants_derivatives {
                    element.fill_with_derivatives(&self.joints, motion, own_shape, &mut out, &mut slopes);
                } else {
                    element.fill(&self.joints, motion, own_shape, &mut out);
                }
                continue;
            }
            if wants_derivatives {
                element.shape_derivatives(&self.joints, motion, own_shape, &mut slopes);
            }
            if !wants_values {
                continue;
            }
            let mut own = vec![0.0; placed.entries.len() * samples];
            let mut out =
                ElementColumns { data: &mut own, slots: &placed.entry_numbers, stride: samples, samples };
            element.fill(&self.joints, motion, own_shape, &mut out);
            for (to, from) in shaped.columns.iter().zip(own.chunks_exact(samples.max(1))) {
                if let Some(to) = to {
                    values[to * stride..][..samples].copy_from_slice(from);
                }
            }
        }
    }
}
