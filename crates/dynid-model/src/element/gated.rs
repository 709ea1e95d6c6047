//! Elements that act in some logs only.

use super::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;

/// Name of the channel that is 1 throughout a log, 0 in all others: the gate of what belongs to that log alone.
pub fn log_channel(log: &str) -> String {
    format!("log {log}")
}

/// Name of the channel that is 1 while a payload is mounted, 0 elsewhere.
pub fn payload_channel(payload: &str) -> String {
    format!("payload {payload}")
}

/// Whether a channel says which log or payload a sample belongs to.
pub fn is_gate(channel: &str) -> bool {
    channel.starts_with("log ") || channel.starts_with("payload ")
}

/// Values of a gate in a block.
pub(super) fn gate<'a>(motion: &MotionBlock<'a>, channel: &str) -> &'a [f64] {
    let Some(values) = motion.channel(channel) else { panic!("motion block without channel `{channel}`") };
    values
}

/// An element without memory and without shape parameters whose columns count in one log: `g(t) · column`, with `g` from
/// [`log_channel`].
///
/// Beside the same element without a gate its parameters are *deviations* of that log from the others: `j1.fo[run_b]` is
/// what has to be added to `j1.fo` in `run_b`. They may have any sign.
#[derive(Debug)]
pub struct Gated {
    element: Box<dyn JointElement>,
    log: String,
}

impl Gated {
    /// The element in the log of this name.
    pub fn new(element: Box<dyn JointElement>, log: &str) -> Self {
        Gated { element, log: log.to_owned() }
    }
}

impl JointElement for Gated {
    fn rates(&self) -> Vec<usize> {
        self.element.rates()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        let own = self.element.parameters(joints).into_iter();
        own.map(|p| Parameter {
            name: format!("{}[{}]", p.name, self.log),
            symbol: format!("{}[{}]", p.symbol, self.log),
            prior: None,
            lower: None,
            upper: None,
            ..p
        })
        .collect()
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        self.element.entries()
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        let mut channels = self.element.channels(joints);
        channels.push(log_channel(&self.log));
        channels
    }
    fn is_of_logs(&self) -> bool {
        true
    }
    fn reversal_speeds(&self) -> Vec<Vec<(usize, f64)>> {
        self.element.reversal_speeds()
    }
    fn fill(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        self.element.fill(joints, motion, shape, out);
        let gate = gate(motion, &log_channel(&self.log));
        for entry in 0..self.element.entries().len() {
            out.column(entry).iter_mut().zip(gate).for_each(|(x, g)| *x *= g);
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
        let (n, entries) = (motion.samples, self.element.entries().len());
        let gate = gate(motion, &log_channel(&self.log));
        let mut data = Vec::with_capacity(entries * n);
        for entry in 0..entries {
            data.extend(weights.column(entry).iter().zip(gate).map(|(w, g)| w * g));
        }
        let slots: Vec<usize> = (0..entries).collect();
        let weights = ElementWeights { data: &data, slots: &slots, stride: n, samples: n };
        self.element.adjoint(joints, motion, shape, &weights, out);
    }
}
