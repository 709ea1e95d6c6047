//! Which coordinates drive which joints, and efforts with their time derivatives.

use super::{PlacedElement, TreeModel};
use crate::effort_model::EffortModel;
use crate::element::{ElasticTransmission, JetMotion};
use dynid_algebra::scalar::Jet;

impl TreeModel {
    fn elastic_elements(&self) -> impl Iterator<Item = &ElasticTransmission> {
        let all = self.elements.iter().chain(self.known.iter().map(|k| &k.placed));
        all.filter_map(|placed| placed.element.elastic())
    }

    /// The motor behind the elastic transmission of a joint, by rate, with the ratio.
    pub fn elastic_motor(&self, link: usize) -> Option<(usize, f64)> {
        self.elastic_elements().find(|e| e.link == link).map(|e| (e.motor, e.ratio))
    }

    /// The joint that a motor drives through an elastic transmission, by rate, with the ratio.
    pub fn elastic_link(&self, motor: usize) -> Option<(usize, f64)> {
        self.elastic_elements().find(|e| e.motor == motor).map(|e| (e.link, e.ratio))
    }

    /// Elastic transmissions in the order of the elements, known ones last, each with values of its parameters; `linear`:
    /// all linear parameters of the model.
    ///
    /// # Panics
    /// If `linear` has the wrong length.
    pub fn elastic_transmissions(&self, linear: &[f64]) -> Vec<(&ElasticTransmission, Vec<f64>)> {
        assert_eq!(linear.len(), self.parameters().linear.len(), "length of linear");
        let own = self.elements.iter().map(|placed| (placed, linear));
        let known = self.known.iter().map(|k| (&k.placed, k.linear.as_slice()));
        // The motor's entries come first in every pair.
        let values = |placed: &PlacedElement, linear: &[f64]| {
            placed.entries.iter().step_by(2).map(|(_, column)| linear[*column]).collect()
        };
        own.chain(known)
            .filter_map(|(placed, linear)| placed.element.elastic().map(|e| (e, values(placed, linear))))
            .collect()
    }

    /// Adds the efforts of the elements at some rates, known elements too, with their time derivatives; elastic
    /// transmissions are left out. Elements that act on none of the `wanted` rates are not asked.
    ///
    /// # Errors
    /// The name of a parameter whose element offers no time derivatives
    /// ([`JointElement::jets`](crate::element::JointElement::jets)).
    ///
    /// # Panics
    /// If a vector has the wrong length.
    pub fn element_jets(
        &self,
        motion: &JetMotion<'_>,
        shape: &[f64],
        linear: &[f64],
        wanted: impl Fn(usize) -> bool,
        effort: &mut [Jet],
    ) -> Result<(), String> {
        self.check_shapes(shape, Some(linear));
        let own = self.elements.iter().map(|placed| (placed, placed.shape(shape), linear));
        let known = self.known.iter().map(|k| (&k.placed, k.shape.as_slice(), k.linear.as_slice()));
        for (placed, shape, linear) in own.chain(known) {
            let element = &placed.element;
            if element.elastic().is_some() || !placed.entries.iter().any(|(rate, _)| wanted(*rate)) {
                continue;
            }
            let mut columns = vec![Jet::default(); placed.entries.len()];
            if !element.jets(&self.joints, motion, shape, &mut columns) {
                let first = element.parameters(&self.joints).into_iter().next();
                return Err(first.map_or_else(String::new, |p| p.name));
            }
            for ((rate, column), jet) in placed.entries.iter().zip(columns) {
                if wanted(*rate) {
                    effort[*rate] += jet.scaled(linear[*column]);
                }
            }
        }
        Ok(())
    }
}
