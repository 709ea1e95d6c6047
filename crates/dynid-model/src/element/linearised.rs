//! Elements linearised about values of their shape parameters.

use super::{
    ElasticTransmission, ElementColumns, ElementWeights, FollowingFriction, JointElement, JointInfo,
};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::{Owner, Parameter};

/// An element about a point `(c₀, α₀)` of its linear and shape parameters: its columns at `α₀`, and one column per shape
/// parameter, `Σ ∂column/∂α · c₀`, whose coefficient is the change of that parameter from `α₀`.
///
/// A linear fit of such a model is one Gauss-Newton step on linear and shape parameters together, and its covariance is
/// that of both. The change is named `<joint>.<symbol> (change)` and bounded by the bounds of the shape parameter. Shape
/// parameters that are not free stay at `α₀` and have no column.
#[derive(Debug)]
pub struct Linearised {
    element: Box<dyn JointElement>,
    shape: Vec<f64>,
    /// Per shape parameter: whether it may change.
    free: Vec<bool>,
    /// Rate and shape parameter of every further column.
    changes: Vec<(usize, usize)>,
    /// Per pair of the element's shape entries: its further column, if the parameter may change, and the factor `c₀`.
    pairs: Vec<(Option<usize>, f64)>,
    entries: Vec<(usize, usize)>,
}

impl Linearised {
    /// `shape`, `linear`: the point, the element's own parameters alone. `free`: per shape parameter, whether it may change.
    ///
    /// # Panics
    /// If a vector has another length than the element has parameters.
    pub fn new(
        element: Box<dyn JointElement>,
        joints: &[JointInfo],
        shape: Vec<f64>,
        linear: Vec<f64>,
        free: Vec<bool>,
    ) -> Self {
        assert_eq!(element.shape(joints).len(), shape.len(), "length of shape");
        assert_eq!(free.len(), shape.len(), "length of free");
        assert_eq!(element.parameters(joints).len(), linear.len(), "length of linear");
        let mut entries = element.entries();
        let mut changes: Vec<(usize, usize)> = Vec::new();
        let mut pairs = Vec::new();
        for (entry, parameter) in element.shape_entries() {
            let (rate, factor) = (entries[entry].0, linear[entries[entry].1]);
            if !free[parameter] {
                pairs.push((None, factor));
                continue;
            }
            let place = changes.iter().position(|c| *c == (rate, parameter)).unwrap_or_else(|| {
                changes.push((rate, parameter));
                changes.len() - 1
            });
            pairs.push((Some(place), factor));
        }
        let place = |parameter: usize| linear.len() + free[..parameter].iter().filter(|f| **f).count();
        entries.extend(changes.iter().map(|(rate, parameter)| (*rate, place(*parameter))));
        Linearised { element, shape, free, changes, pairs, entries }
    }

    fn own_entries(&self) -> usize {
        self.entries.len() - self.changes.len()
    }
}

/// Name of the linear parameter that stands for the change of a shape parameter.
pub fn change_name(shape_parameter: &str) -> String {
    format!("{shape_parameter} (change)")
}

impl JointElement for Linearised {
    fn rates(&self) -> Vec<usize> {
        self.element.rates()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let mut out = self.element.parameters(joints);
        let joint = &joints[self.element.rates().first().copied().unwrap_or(0)];
        let free = self.element.shape(joints).into_iter().zip(&self.shape).zip(&self.free);
        out.extend(free.filter(|(_, free)| **free).map(|((shape, at), _)| {
            let symbol = shape.name.rsplit('.').next().unwrap_or_default();
            Parameter {
                name: change_name(&shape.name),
                symbol: format!("d{symbol}{}", joint.number),
                unit: shape.unit,
                owner: Owner::Joint(joint.name.clone()),
                prior: None,
                lower: Some(shape.lower - at),
                upper: Some(shape.upper - at),
                fold_first: true,
            }
        }));
        out
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        self.entries.clone()
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        self.element.channels(joints)
    }
    fn signals(&self, joints: &[JointInfo]) -> Vec<String> {
        self.element.signals(joints)
    }
    fn remember(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        step_s: f64,
        _: &[f64],
        state: &mut Vec<f64>,
        out: &mut [&mut [f64]],
    ) {
        self.element.remember(joints, motion, step_s, &self.shape, state, out);
    }
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        self.element.reversal_speeds()
    }
    fn elastic(&self) -> Option<&ElasticTransmission> {
        self.element.elastic()
    }
    fn opposes_motion(&self) -> bool {
        self.element.opposes_motion()
    }
    fn is_of_position(&self) -> bool {
        self.element.is_of_position()
    }
    fn reaction_friction(&self) -> Option<FollowingFriction<'_>> {
        let following = self.element.reaction_friction()?;
        Some(FollowingFriction { held: Some(&self.shape), ..following })
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let own = self.own_entries();
        let mut columns = ElementColumns {
            data: &mut *out.data,
            slots: &out.slots[..own],
            stride: out.stride,
            samples: out.samples,
        };
        self.element.fill(joints, motion, &self.shape, &mut columns);
        if self.changes.is_empty() {
            return;
        }
        let n = motion.samples;
        let slots: Vec<usize> = (0..self.pairs.len()).collect();
        let mut memory = vec![0.0; self.pairs.len() * n];
        let mut derivatives = ElementColumns { data: &mut memory, slots: &slots, stride: n, samples: n };
        self.element.shape_derivatives(joints, motion, &self.shape, &mut derivatives);
        for change in 0..self.changes.len() {
            out.column(own + change).fill(0.0);
        }
        for ((change, factor), derivative) in self.pairs.iter().zip(memory.chunks_exact(n.max(1))) {
            let Some(change) = change else { continue };
            for (to, d) in out.column(own + change).iter_mut().zip(derivative) {
                *to += factor * d;
            }
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let (own, n) = (self.own_entries(), motion.samples);
        let columns = ElementWeights { slots: &weights.slots[..own], ..*weights };
        self.element.adjoint(joints, motion, &self.shape, &columns, out);
        let mut memory = Vec::with_capacity(self.pairs.len() * n);
        for (change, factor) in &self.pairs {
            match change {
                Some(change) => memory.extend(weights.column(own + change).iter().map(|w| factor * w)),
                None => memory.resize(memory.len() + n, 0.0),
            }
        }
        let slots: Vec<usize> = (0..self.pairs.len()).collect();
        let pairs = ElementWeights { data: &memory, slots: &slots, stride: n, samples: n };
        self.element.shape_adjoint(joints, motion, &self.shape, &pairs, out);
    }
}
