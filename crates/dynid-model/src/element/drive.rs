//! Drive gains.

use super::{ElementColumns, ElementWeights, JointElement, JointInfo, current_channel};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::parameter::Parameter;

/// Drive gain `K` (effort per ampere) as a parameter: column `-i` on the right-hand side of
/// `0 = Y φ + elements - K i + known effort`.
///
/// Needs the channel [`current_channel`]. One unloaded log cannot determine `K`: gain and all other parameters scale
/// together. It takes a load of known effort; a known gain is a conversion of the log instead.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveGain {
    /// Rate it acts on.
    pub rate: usize,
}

impl JointElement for DriveGain {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("K", ["N m/A", "N/A"], Some(0.0))]
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn channels(&self, joints: &[JointInfo]) -> Vec<String> {
        vec![current_channel(&joints[self.rate].name)]
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let name = current_channel(&joints[self.rate].name);
        let Some(current) = motion.channel(&name) else { panic!("motion block without channel `{name}`") };
        out.map(0, current, |i| -i);
    }
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
