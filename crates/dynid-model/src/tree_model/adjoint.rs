//! Efforts without a regressor, and the adjoints of efforts and regressor.

use super::{CoupledRegressor, TreeModel};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, RegressorBlock};
use crate::element::ElementWeights;

impl TreeModel {
    pub(super) fn check_shapes(&self, shape: &[f64], linear: Option<&[f64]>) {
        assert_eq!(shape.len(), self.parameters.shape.len(), "length of shape");
        if let Some(linear) = linear {
            assert_eq!(linear.len(), self.parameters.linear.len(), "length of linear");
        }
    }

    pub(super) fn block_efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        self.check_shapes(shape, Some(linear));
        let inertial = self.dynamics.inertial_parameters();
        for output in self.mechanism.rates()..self.outputs.len() {
            effort[output * stride..][..motion.samples].fill(0.0);
        }
        self.dynamics.inverse_dynamics_block(motion, &linear[..inertial], stride, effort);
        self.element_efforts(motion, shape, linear, stride, effort, &mut Vec::new());
    }

    pub(super) fn block_effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
    ) {
        self.check_shapes(shape, Some(linear));
        out.check(self.dimensions(), motion.samples);
        let n = motion.samples;
        let inertias = &linear[..self.dynamics.inertial_parameters()];
        match &self.coupled {
            None => self.dynamics.effort_adjoint_block(motion, inertias, stride, weights, out),
            Some(coupled) => {
                let follows = self.mechanism.follows().unwrap_or(&[]);
                let joint_weights: Vec<f64> = follows
                    .iter()
                    .flat_map(|f| weights[f.coordinate * stride..][..n].iter().map(|w| f.ratio * w))
                    .collect();
                self.at_joints(coupled, motion, out, |motion, out| {
                    coupled.dynamics.effort_adjoint_block(motion, inertias, n, &joint_weights, out);
                });
            }
        }
        self.element_adjoint(motion, shape, linear, (stride, weights), out, &mut Vec::new());
    }

    pub(super) fn block_regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        self.check_shapes(shape, None);
        out.check(self.dimensions(), motion.samples);
        assert_eq!(*weights.layout(), *self.layout, "weights of another model");
        assert_eq!(weights.samples(), motion.samples, "samples of the weights");
        let n = motion.samples;
        let (data, stride) = (weights.data(), weights.stride());
        match &self.coupled {
            None => self.dynamics.regressor_adjoint_block(motion, &self.slots, stride, data, out),
            Some(coupled) => {
                let mut joint_weights = vec![0.0; coupled.slot_count * n];
                for (joint_slot, slot, ratio) in &coupled.folds {
                    for c in 0..10 {
                        let from = &data[(slot + c) * stride..][..n];
                        for (t, w) in joint_weights[(joint_slot + c) * n..].iter_mut().zip(from) {
                            *t = ratio * w;
                        }
                    }
                }
                self.at_joints(coupled, motion, out, |motion, out| {
                    coupled.dynamics.regressor_adjoint_block(motion, &coupled.slots, n, &joint_weights, out);
                });
            }
        }
        for placed in &self.elements {
            let weights = ElementWeights { data, slots: &placed.slots, stride, samples: n };
            placed.element.adjoint(&self.joints, motion, placed.shape(shape), &weights, out);
        }
    }

    /// Runs work on the motion of all joints and folds the derivatives into the coordinates that they follow.
    fn at_joints(
        &self,
        coupled: &CoupledRegressor,
        motion: &MotionBlock<'_>,
        out: &mut MotionAdjoint,
        work: impl FnOnce(&MotionBlock<'_>, &mut MotionAdjoint),
    ) {
        let n = motion.samples;
        let mut joint = MotionAdjoint::new(coupled.dynamics.positions(), coupled.dynamics.rates(), n);
        coupled.with_joint_motion(&self.mechanism, motion, |motion| work(motion, &mut joint));
        let add = |to: &mut [f64], at: usize, from: &[f64], joint: usize, ratio: f64| {
            for (t, d) in to[at * n..][..n].iter_mut().zip(&from[joint * n..]) {
                *t += ratio * d;
            }
        };
        for body in self.mechanism.bodies() {
            for f in self.mechanism.follows().iter().map(|f| f[body.rate]) {
                let position = f.coordinate + self.mechanism.quaternions_before(f.coordinate);
                add(&mut out.q, position, &joint.q, body.position, f.ratio);
                add(&mut out.dq, f.coordinate, &joint.dq, body.rate, f.ratio);
                add(&mut out.ddq, f.coordinate, &joint.ddq, body.rate, f.ratio);
            }
        }
    }
}
