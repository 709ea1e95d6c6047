//! Maxwell slip: dry friction that gives way like a spring before it slips.

use super::{EFFORT, POSITION, remembered};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::element::shape::{places, values};
use crate::element::{
    ElementColumns, ElementWeights, JointElement, JointInfo, LinearTerm, ShapeSetting, ShapeTerm, sign,
};
use crate::parameter::{Parameter, ShapeParameter};

/// A spring in series with dry friction, a Maxwell-slip element (Al-Bender, Lampaert & Swevers 2005): effort `fm w` with
///
/// `ẇ = q̇ / travel` while `|w| < 1`, `w` stays at `s(q̇)` beyond.
///
/// After a reversal the joint travels `2 travel` before the friction stands against the new motion: a loop over position, whatever
/// the speed, and at rest the value at which the joint came to rest. One column for `fm`, shape parameter `travel`. It stands beside
/// [`Coulomb`](super::Coulomb) or another law with a sign, which is the part of dry friction that has no such travel: far from reversals
/// both together are the Coulomb friction.
///
/// The column is a signal that [`JointElement::remember`] forms sample after sample from the positions, exact for motion in one direction between
/// two samples; where the velocity is 0 the joint stands, and what its position does there is noise. A record starts at `w = s(v)`, 0 at rest; signs are exact there, whatever a block smooths. Where a motion block comes without
/// the signal, `s(v)` stands in for it.
#[derive(Debug, Clone, PartialEq)]
pub struct MaxwellSlip {
    /// Rate it acts on.
    pub rate: usize,
    /// What the joint travels from `w = 0` until the friction slips, rad or m, positive. Default: 1e-5 .. 0.1, from 1e-3.
    pub travel: ShapeSetting,
}

impl MaxwellSlip {
    /// Name of the signal `w`, after that of the joint and a dot.
    pub const SPRING: &str = "slip_spring";
    /// Name of its derivative by `travel`, alike.
    const BY_TRAVEL: &str = "slip_spring_by_travel";

    /// Its linear parameter `fm`, N m or N.
    pub const FRICTION: LinearTerm = LinearTerm::effort("fm").friction();
    /// Its shape parameter `travel`.
    pub const TRAVEL: ShapeTerm = ShapeTerm::positive("travel", POSITION, 1e-5, 0.1);

    /// With the default travel.
    pub fn new(rate: usize) -> Self {
        MaxwellSlip { rate, travel: Self::TRAVEL.setting(1.0) }
    }
}

/// What a [`MaxwellSlip`] remembers of the motion.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct SlipSpring {
    w: f64,
    position: f64,
}

impl SlipSpring {
    /// At the start of a record, at a position (rad or m) and a speed (rad/s or m/s).
    pub fn at(position: f64, speed: f64) -> Self {
        SlipSpring { w: sign(speed), position }
    }

    /// Takes it to the next sample and gives the displacement that counts, in parts of `travel` (rad or m): none at speed 0, where the joint stands.
    #[inline]
    pub fn move_to(&mut self, position: f64, speed: f64, travel: f64) -> f64 {
        let moved = if speed == 0.0 { 0.0 } else { (position - self.position) / travel };
        self.w = (self.w + moved).clamp(-1.0, 1.0);
        self.position = position;
        moved
    }

    /// `w`, between -1 and 1.
    pub fn w(&self) -> f64 {
        self.w
    }
}

impl JointElement for MaxwellSlip {
    fn rates(&self) -> Vec<usize> {
        vec![self.rate]
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        vec![joints[self.rate].parameter("fm", EFFORT, Some(0.0))]
    }
    fn shape(&self, joints: &[JointInfo]) -> Vec<ShapeParameter> {
        let free = (!self.travel.held).then(|| Self::TRAVEL.parameter(&self.travel, &joints[self.rate]));
        free.into_iter().collect()
    }
    fn is_friction(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        vec![(self.rate, 0)]
    }
    fn signals(&self, joints: &[JointInfo]) -> Vec<String> {
        let derivative = (!self.travel.held).then_some(Self::BY_TRAVEL);
        let names = std::iter::once(Self::SPRING).chain(derivative);
        names.map(|name| format!("{}.{name}", joints[self.rate].name)).collect()
    }
    fn remember(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: f64,
        shape: &[f64],
        state: &mut Vec<f64>,
        out: &mut [&mut [f64]],
    ) {
        let [travel] = values([&self.travel], shape);
        let positions = motion.position(joints[self.rate].position);
        let speeds = motion.rate(self.rate);
        let (Some(start), Some(speed)) = (positions.first(), speeds.first()) else { return };
        if state.is_empty() {
            state.extend([sign(*speed), *start, 0.0]);
        }
        let mut spring = SlipSpring { w: state[0], position: state[1] };
        let mut by_travel = state[2];
        for (k, (position, speed)) in positions.iter().zip(speeds).enumerate() {
            let moved = spring.move_to(*position, *speed, travel);
            // A joint that stands leaves the derivative, slipping or not.
            if *speed != 0.0 {
                by_travel = if spring.w.abs() < 1.0 { by_travel - moved / travel } else { 0.0 };
            }
            out[0][k] = spring.w;
            if let Some(derivative) = out.get_mut(1) {
                derivative[k] = by_travel;
            }
        }
        state.copy_from_slice(&[spring.w, spring.position, by_travel]);
    }
    fn fill(&self, joints: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        match remembered(&joints[self.rate], motion, Self::SPRING) {
            Some(spring) => out.column(0).copy_from_slice(spring),
            None => motion.fill_signs(motion.rate(self.rate), out.column(0)),
        }
    }
    fn shape_entries(&self) -> Vec<(usize, usize)> {
        places([&self.travel]).into_iter().flatten().map(|place| (0, place)).collect()
    }
    fn shape_derivatives(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        out: &mut ElementColumns<'_>,
    ) {
        if self.travel.held {
            return;
        }
        match remembered(&joints[self.rate], motion, Self::BY_TRAVEL) {
            Some(derivative) => out.column(0).copy_from_slice(derivative),
            None => out.column(0).fill(0.0),
        }
    }
    /// Derivatives of the steady state: the signal of the motion before is held.
    fn adjoint(
        &self,
        joints: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        if remembered(&joints[self.rate], motion, Self::SPRING).is_none() {
            let slope = |v: f64| motion.sign_slope(v);
            weights.add(0, self.rate, motion.rate(self.rate), slope, &mut out.dq);
        }
    }
}
