//! Friction that grows with the load of the gear.

use std::sync::Arc;

use super::NUMBER;
use crate::dynamics::{Dynamics, MotionAdjoint, MotionBlock};
use crate::element::{ElementColumns, ElementWeights, JointElement, JointInfo, sign};
use crate::mechanism::Mechanism;
use crate::parameter::Parameter;

/// Friction of loaded gears, `μ |τ_j| s(v)` beside Coulomb friction: one column `|τ_j| s(v)` for `mu` per rate
/// in the form of gears.
///
/// `τ_j` is the effort of rigid bodies with given *reference* inertias, held fixed: measured efforts would bring their
/// noise into the column, and the inertias being estimated would make it nonlinear. Any parameters with the right base
/// values will do.
#[derive(Debug)]
pub struct LoadFriction {
    rates: Vec<usize>,
    dynamics: Dynamics,
    reference: Arc<[f64]>,
}

impl LoadFriction {
    /// At some rates of a mechanism. `reference`: ten standard parameters per body.
    ///
    /// # Panics
    /// If `reference` has another length, or the mechanism couples joints.
    pub fn new(mechanism: &Mechanism, rates: Vec<usize>, reference: Arc<[f64]>) -> Self {
        assert_eq!(reference.len(), mechanism.inertial_parameters(), "length of the reference");
        assert!(mechanism.follows().is_none(), "a mechanism that couples joints");
        LoadFriction { rates, dynamics: Dynamics::new(mechanism), reference }
    }

    fn loads(&self, motion: &MotionBlock<'_>) -> Vec<f64> {
        let mut loads = vec![0.0; self.dynamics.rates() * motion.samples];
        self.dynamics.inverse_dynamics_block(motion, &self.reference, motion.samples, &mut loads);
        loads
    }
}

impl JointElement for LoadFriction {
    fn rates(&self) -> Vec<usize> {
        self.rates.clone()
    }
    fn parameters(&self, joints: &[JointInfo]) -> Vec<Parameter> {
        self.rates.iter().map(|rate| joints[*rate].parameter("mu", NUMBER, Some(0.0))).collect()
    }
    fn opposes_motion(&self) -> bool {
        true
    }
    fn entries(&self) -> Vec<(usize, usize)> {
        self.rates.iter().copied().enumerate().map(|(k, rate)| (rate, k)).collect()
    }
    fn fill(&self, _: &[JointInfo], motion: &MotionBlock<'_>, _: &[f64], out: &mut ElementColumns<'_>) {
        let n = motion.samples;
        let loads = self.loads(motion);
        for (k, rate) in self.rates.iter().enumerate() {
            let speeds = motion.rate(*rate);
            let column = out.column(k);
            for ((to, v), load) in column.iter_mut().zip(speeds).zip(&loads[rate * n..]) {
                *to = motion.sign(*v) * load.abs();
            }
        }
    }
    fn adjoint(
        &self,
        _: &[JointInfo],
        motion: &MotionBlock<'_>,
        _: &[f64],
        weights: &ElementWeights<'_>,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        let loads = self.loads(motion);
        let mut by_load = vec![0.0; loads.len()];
        for (k, rate) in self.rates.iter().enumerate() {
            let own = rate * n..(rate + 1) * n;
            let signals = motion.rate(*rate).iter().zip(&loads[own.clone()]).zip(weights.column(k));
            let targets = by_load[own.clone()].iter_mut().zip(&mut out.dq[own]);
            for (((v, load), w), (by_load, by_speed)) in signals.zip(targets) {
                *by_load = w * motion.sign(*v) * sign(*load);
                *by_speed += w * motion.sign_slope(*v) * load.abs();
            }
        }
        self.dynamics.effort_adjoint_block(motion, &self.reference, n, &by_load, out);
    }
}
