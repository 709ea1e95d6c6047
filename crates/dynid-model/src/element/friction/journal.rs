//! Friction of a journal in its bearing, as its drive feels it.

use super::NUMBER;
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo};
use crate::parameter::Parameter;

/// Name of the channel that holds the moment of a bearing's friction per unit of its coefficient, N m.
pub fn journal_moment_channel(joint: &str) -> String {
    format!("journal_moment_{joint}")
}

/// Friction of a journal in its bearing: `e = mu · M`, with the moment `M = R2 c_d(v_t) F_n` of a unit coefficient from a channel
/// ([`journal_moment_channel`]), which a [`JournalModel`](crate::JournalModel) computes itself.
///
/// Parameter: the friction coefficient `<joint>.mu`, from 0 on and without unit; the name is that of
/// [`ClearanceContact`](crate::element::ClearanceContact), whose friction it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct JournalFriction {
    /// Rate of the joint.
    pub rate: usize,
}

impl JournalFriction {
    fn moment<'a>(&self, joints: &[JointInfo], motion: &MotionBlock<'a>) -> &'a [f64] {
        let name = journal_moment_channel(&joints[self.rate].name);
        let Some(moment) = motion.channel(&name) else { panic!("motion block without channel `{name}`") };
        moment
    }
}

impl JointElement for JournalFriction {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("mu", NUMBER, Some(0.0))]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        vec![journal_moment_channel(&joints[self.rate].name)]
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.column(0).copy_from_slice(&self.moment(joints, motion)[..motion.samples]);
    }
    /// The moment counts as given.
    fn adjoint(
        &self,
        _: &[JointInfo],
        _: &MotionBlock<'_>,
        _: &[f64],
        _: &ElementWeights<'_>,
        _: &mut MotionAdjoint,
    ) {
    }
}
