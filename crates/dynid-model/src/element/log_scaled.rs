//! Elements whose effort is larger or smaller in some logs.

use super::gated::{gate, log_channel};
use super::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::{Parameter, ShapeParameter};

/// Several elements with one factor per log on all their columns, `(1 + Σ_l (λ_l - 1) g_l(t)) · column`, with `g_l` from
/// [`log_channel`]: friction of a robot whose gears are colder in log `l`. Where all gates are 0 they act as they are.
///
/// Parameters are those of the elements, one after the other; shape parameters, too, followed by one `λ_l` per log, named
/// [`scale_name`], between 0.1 and 10.
///
/// One of the elements is seen by [`JointElement::scaled`]; effort and linear parameters are bilinear in `λ` and the others.
#[derive(Debug)]
pub struct LogScaled {
    parts: Vec<ScaledPart>,
    /// Logs, and where a search of their factors starts.
    logs: Vec<(String, f64)>,
    entries: Vec<(usize, usize)>,
    shapes: usize,
    shape_entries: Vec<(usize, usize)>,
}

/// One element of [`LogScaled`].
#[derive(Debug)]
pub struct ScaledPart {
    /// The element.
    pub element: Box<dyn JointElement>,
    /// First of its entries.
    pub first_entry: usize,
    /// First of its shape parameters.
    pub first_shape: usize,
    /// Number of its shape parameters.
    pub shapes: usize,
}

/// Name of the shape parameter `λ` of a log.
pub fn scale_name(log: &str) -> String {
    format!("friction_scale[{log}]")
}

/// Factors that a search looks at.
const FACTORS: (f64, f64) = (0.1, 10.0);

impl LogScaled {
    /// Elements with a factor for each of these logs, a search of which starts at the value given. `joints`: one per rate of the mechanism.
    ///
    /// # Panics
    /// If there is no element or no log, or an element remembers the motion before.
    pub fn new(elements: Vec<Box<dyn JointElement>>, joints: &[JointInfo], logs: Vec<(String, f64)>) -> Self {
        assert!(!elements.is_empty() && !logs.is_empty(), "{} elements, {} logs", elements.len(), logs.len());
        let mut out = LogScaled {
            parts: Vec::with_capacity(elements.len()),
            logs,
            entries: Vec::new(),
            shapes: 0,
            shape_entries: Vec::new(),
        };
        let mut parameters = 0;
        for element in elements {
            assert!(element.signals(joints).is_empty(), "an element with memory, scaled by log");
            let part = ScaledPart {
                first_entry: out.entries.len(),
                first_shape: out.shapes,
                shapes: element.shape(joints).len(),
                element,
            };
            out.entries.extend(part.element.entries().iter().map(|(rate, p)| (*rate, parameters + p)));
            let pairs = part.element.shape_entries().into_iter();
            out.shape_entries.extend(pairs.map(|(e, s)| (part.first_entry + e, part.first_shape + s)));
            parameters += part.element.parameters(joints).len();
            out.shapes += part.shapes;
            out.parts.push(part);
        }
        for log in 0..out.logs.len() {
            out.shape_entries.extend((0..out.entries.len()).map(|entry| (entry, out.shapes + log)));
        }
        out
    }

    /// The elements in order.
    pub fn parts(&self) -> &[ScaledPart] {
        &self.parts
    }

    /// Factor of every sample.
    fn factors(&self, motion: &MotionBlock<'_>, shape: &[f64]) -> Vec<f64> {
        let mut factors = vec![1.0; motion.samples];
        for ((log, _), scale) in self.logs.iter().zip(&shape[self.shapes..]) {
            let gate = gate(motion, &log_channel(log));
            factors.iter_mut().zip(gate).for_each(|(f, g)| *f += (scale - 1.0) * g);
        }
        factors
    }
}

impl ScaledPart {
    /// Shape parameters of this part among those of all parts.
    pub fn shape<'a>(&self, all: &'a [f64]) -> &'a [f64] {
        &all[self.first_shape..self.first_shape + self.shapes]
    }

    /// Entries of this part among those of all parts.
    pub fn entries(&self) -> std::ops::Range<usize> {
        self.first_entry..self.first_entry + self.element.entries().len()
    }
}

impl JointElement for LogScaled {
    fn rates(&self) -> Vec<usize> {
        let mut rates: Vec<usize> = self.entries.iter().map(|(rate, _)| *rate).collect();
        rates.sort_unstable();
        rates.dedup();
        rates
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        self.parts.iter().flat_map(|part| part.element.parameters(joints)).collect()
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let scale = |(log, start): &(String, f64)| ShapeParameter {
            name: scale_name(log),
            unit: "1",
            start: *start,
            lower: FACTORS.0,
            upper: FACTORS.1,
            logarithmic: true,
        };
        let own = self.parts.iter().flat_map(|part| part.element.shape(joints));
        own.chain(self.logs.iter().map(scale)).collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        self.entries.clone()
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        let own = self.parts.iter().flat_map(|part| part.element.channels(joints));
        own.chain(self.logs.iter().map(|(log, _)| log_channel(log))).collect()
    }
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        self.parts.iter().flat_map(|part| part.element.reversal_speeds()).collect()
    }
    fn scaled(&self) -> Option<&LogScaled> {
        Some(self)
    }
    fn opposes_motion(&self) -> bool {
        self.parts.iter().all(|part| part.element.opposes_motion())
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let factors = self.factors(motion, shape);
        for part in &self.parts {
            let slots = &out.slots[part.entries()];
            let mut own = ElementColumns { data: &mut *out.data, slots, ..*out };
            part.element.fill(joints, motion, part.shape(shape), &mut own);
        }
        for entry in 0..self.entries.len() {
            out.column(entry).iter_mut().zip(&factors).for_each(|(x, f)| *x *= f);
        }
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        self.shape_entries.clone()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        let n = motion.samples;
        let factors = self.factors(motion, shape);
        let mut pair = 0;
        for part in &self.parts {
            let pairs = part.element.shape_entries().len();
            let slots = &out.slots[pair..pair + pairs];
            let mut own = ElementColumns { data: &mut *out.data, slots, ..*out };
            part.element.shape_derivatives(joints, motion, part.shape(shape), &mut own);
            for k in 0..pairs {
                own.column(k).iter_mut().zip(&factors).for_each(|(x, f)| *x *= f);
            }
            pair += pairs;
        }
        let mut columns = vec![0.0; self.entries.len() * n];
        let slots: Vec<usize> = (0..self.entries.len()).collect();
        for part in &self.parts {
            let slots = &slots[part.entries()];
            let mut own = ElementColumns { data: &mut columns, slots, stride: n, samples: n };
            part.element.fill(joints, motion, part.shape(shape), &mut own);
        }
        for (log, _) in &self.logs {
            let gate = gate(motion, &log_channel(log));
            for column in columns.chunks_exact(n.max(1)) {
                for ((to, x), g) in out.column(pair).iter_mut().zip(column).zip(gate) {
                    *to = g * x;
                }
                pair += 1;
            }
        }
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let factors = self.factors(motion, shape);
        let data = scaled_weights(weights, 0..self.entries.len(), &factors);
        self.parts_adjoint(joints, motion, shape, &data, out);
    }
    fn shape_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        let factors = self.factors(motion, shape);
        let mut pair = 0;
        for part in &self.parts {
            let pairs = part.element.shape_entries().len();
            let data = scaled_weights(weights, pair..pair + pairs, &factors);
            let slots: Vec<usize> = (0..pairs).collect();
            let own = ElementWeights { data: &data, slots: &slots, stride: n, samples: n };
            part.element.shape_adjoint(joints, motion, part.shape(shape), &own, out);
            pair += pairs;
        }
        for (log, _) in &self.logs {
            let gate = gate(motion, &log_channel(log));
            let data = scaled_weights(weights, pair..pair + self.entries.len(), gate);
            self.parts_adjoint(joints, motion, shape, &data, out);
            pair += self.entries.len();
        }
    }
}

/// Columns of weights times one signal, one after the other.
fn scaled_weights(
    weights: &ElementWeights<'_>,
    columns: std::ops::Range<usize>,
    factors: &[f64],
) -> Vec<f64> {
    columns.flat_map(|k| weights.column(k).iter().zip(factors).map(|(w, f)| w * f)).collect()
}

impl LogScaled {
    /// Adjoint of the elements as they are; `data`: weights of all entries, one column after the other.
    fn parts_adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        data: &[f64],
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        for part in &self.parts {
            let slots: Vec<usize> = part.entries().collect();
            let own = ElementWeights { data, slots: &slots, stride: n, samples: n };
            part.element.adjoint(joints, motion, part.shape(shape), &own, out);
        }
    }
}
