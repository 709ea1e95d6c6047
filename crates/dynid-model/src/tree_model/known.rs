//! Elements whose parameters are known: part of the effort that no parameter stands for.

use super::{PlacedElement, TreeModel};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::RegressorBlock;
use crate::element::{ElementColumns, ElementWeights, JointElement};
use crate::parameter::Parameter;

/// An element with values of all of its parameters.
#[derive(Debug)]
pub struct KnownElement {
    /// The element.
    pub element: Box<dyn JointElement>,
    /// Values of its linear parameters, in its own order.
    pub linear: Vec<f64>,
    /// Values of its free shape parameters.
    pub shape: Vec<f64>,
}

/// A known element in its place; entries are `(rate, own linear parameter)`.
#[derive(Debug)]
pub(super) struct PlacedKnown {
    pub(super) placed: PlacedElement,
    pub(super) linear: Vec<f64>,
    pub(super) shape: Vec<f64>,
}

impl TreeModel {
    /// Returns the model with elements whose efforts are known: they go into the offset of the effort
    /// (`effort = W linear + offset`) and into predictions, not into the parameters.
    ///
    /// # Panics
    /// If an element names a rate that the mechanism does not have, a vector has another length than the element has
    /// parameters, or two elements at a joint remember the same signals.
    #[must_use]
    pub fn with_known(mut self, known: Vec<KnownElement>) -> Self {
        for KnownElement { element, linear, shape } in known {
            let entries = element.entries();
            assert!(entries.iter().all(|(rate, _)| *rate < self.joints.len()), "rate of a known element");
            assert_eq!(element.parameters(&self.joints).len(), linear.len(), "length of linear");
            assert_eq!(element.shape(&self.joints).len(), shape.len(), "length of shape");
            for channel in element.channels(&self.joints) {
                if !self.channels.contains(&channel) {
                    self.channels.push(channel);
                }
            }
            let placed = PlacedElement {
                slots: Vec::new(),
                entry_numbers: (0..entries.len()).collect(),
                entries,
                first_shape: 0,
                shapes: shape.len(),
                signals: element.signals(&self.joints).len(),
                element,
            };
            self.known.push(PlacedKnown { placed, linear, shape });
        }
        self.signals = self.signal_names();
        self
    }

    /// Returns the model with linear parameters of any sign where `is_free` says so: errors of known elements, say, have no
    /// reason to be positive.
    #[must_use]
    pub fn with_free_sign(mut self, is_free: impl Fn(&Parameter) -> bool) -> Self {
        for parameter in self.parameters.linear.iter_mut().filter(|p| is_free(p)) {
            if parameter.lower == Some(0.0) {
                parameter.lower = None;
            }
        }
        self
    }

    /// Whether part of the effort is known.
    pub fn has_known_elements(&self) -> bool {
        !self.known.is_empty()
    }

    /// Hands the known efforts of a block on, rate by rate.
    pub(super) fn known_efforts(
        &self,
        motion: &MotionBlock<'_>,
        memory: &mut Vec<f64>,
        mut add: impl FnMut(usize, &[f64], f64),
    ) {
        let n = motion.samples;
        for PlacedKnown { placed, linear, shape } in &self.known {
            memory.clear();
            memory.resize(placed.entries.len() * n, 0.0);
            let slots = &placed.entry_numbers;
            let mut columns = ElementColumns { data: memory, slots, stride: n, samples: n };
            placed.element.fill(&self.joints, motion, shape, &mut columns);
            for ((rate, parameter), values) in placed.entries.iter().zip(memory.chunks_exact(n.max(1))) {
                add(*rate, values, linear[*parameter]);
            }
        }
    }

    pub(super) fn fill_known(&self, motion: &MotionBlock<'_>, out: &mut RegressorBlock) {
        self.known_efforts(motion, &mut Vec::new(), |rate, values, factor| {
            for (o, x) in out.offset_mut(rate).iter_mut().zip(values) {
                *o += factor * x;
            }
        });
    }

    /// Adds the derivatives of `Σ weights[output * stride + s] · known effort` with respect to the motion.
    pub(super) fn known_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
        memory: &mut Vec<f64>,
    ) {
        let n = motion.samples;
        for PlacedKnown { placed, linear, shape } in &self.known {
            memory.clear();
            for (rate, parameter) in &placed.entries {
                memory.extend(weights[rate * stride..][..n].iter().map(|w| w * linear[*parameter]));
            }
            let weights =
                ElementWeights { data: memory, slots: &placed.entry_numbers, stride: n, samples: n };
            placed.element.adjoint(&self.joints, motion, shape, &weights, out);
        }
    }
}
