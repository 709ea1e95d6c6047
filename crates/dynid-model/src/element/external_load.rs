//! Loads that come with the log.

use super::{ElementColumns, ElementWeights, JetMotion, JointElement, JointInfo};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;
use dynid_algebra::scalar::Jet;

/// Name of the channel that holds the external load of a joint, N m or N.
pub fn load_channel(joint: &str) -> String {
    format!("load_{joint}")
}

/// External load of a joint, `factor · T(t)` with `T` from the channel [`load_channel`] (N m or N, positive against positive
/// motion, like friction); as a brake `factor · T(t) s(v)`, which opposes motion in either direction. One column `T` or
/// `T s(v)` for `load`, a number without unit.
///
/// A load of known size is a [`KnownElement`](crate::KnownElement) with factor 1.
#[derive(Debug, Clone, PartialEq)]
pub struct ExternalLoad {
    /// Rate it acts on.
    pub rate: usize,
    /// Whether it takes the sign of the velocity.
    pub brake: bool,
}

impl ExternalLoad {
    fn load<'a>(&self, joints: &[JointInfo], motion: &MotionBlock<'a>) -> &'a [f64] {
        let name = load_channel(&joints[self.rate].name);
        let Some(load) = motion.channel(&name) else { panic!("motion block without channel `{name}`") };
        load
    }
}

impl JointElement for ExternalLoad {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("load", ["1", "1"], None)]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        vec![load_channel(&joints[self.rate].name)]
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        out.column(0).copy_from_slice(self.load(joints, motion));
        if self.brake {
            let speeds = motion.rate(self.rate);
            out.column(0).iter_mut().zip(speeds).for_each(|(t, v)| *t *= motion.sign(*v));
        }
    }
    fn jets(&self, joints: &[JointInfo], motion: &JetMotion<'_>, _: &[f64], out: &mut [Jet]) -> bool {
        let Some(load) = motion.channel(&load_channel(&joints[self.rate].name)) else { return false };
        out[0] = if self.brake { load * motion.sign(motion.dq[self.rate]) } else { load };
        true
    }
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if !self.brake {
            return;
        }
        let to = &mut out.dq[self.rate * motion.samples..][..motion.samples];
        let signals = self.load(joints, motion).iter().zip(motion.rate(self.rate));
        for ((to, w), (load, v)) in to.iter_mut().zip(weights.column(0)).zip(signals) {
            *to += w * load * motion.sign_slope(*v);
        }
    }
}
