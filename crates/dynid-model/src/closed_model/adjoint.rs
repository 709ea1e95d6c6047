//! Derivatives of efforts and of the regressor by the motion of the independent coordinates.

use super::ClosedModel;
use super::expand::Expanded;
use crate::closed::{CarryWorkspace, PoseWorkspace, Seeds};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, RegressorBlock};

impl ClosedModel {
    pub(super) fn add_effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        (shape, linear): (&[f64], &[f64]),
        (stride, weights): (usize, &[f64]),
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        out.check(self.dimensions(), n);
        let (expanded, poses) = self.expand_poses(motion);
        let rates = self.machine.mechanism().rates();
        let outputs = self.outputs().len();
        let mut tree_weights = vec![0.0; rates * n];
        for output in 0..outputs {
            for rate in self.fold.rates(output) {
                let to = &mut tree_weights[rate * n..][..n];
                expanded.add(output, rate, &weights[output * stride..][..n], to);
            }
        }
        let mut effort = vec![0.0; rates * n];
        let mut by = MotionAdjoint::new(rates, rates, n);
        let pressed = self.pressed(motion);
        expanded.with_block(motion, &pressed.channels(), |block| {
            self.tree.efforts(block, shape, linear, n, &mut effort);
            self.tree.effort_adjoint(block, shape, linear, n, &tree_weights, &mut by);
        });
        let work = |sample: usize| {
            let tree: Vec<f64> = (0..rates).map(|r| effort[r * n + sample]).collect();
            let asked: Vec<f64> = (0..outputs).map(|o| weights[o * stride + sample]).collect();
            vec![(tree, asked)]
        };
        self.carry_all(&expanded, &poses, &by, work, out);
    }

    pub(super) fn add_regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        let n = motion.samples;
        out.check(self.dimensions(), n);
        assert_eq!(*weights.layout(), *self.fold.layout, "weights of another model");
        assert_eq!(weights.samples(), n, "samples of the weights");
        let (expanded, poses) = self.expand_poses(motion);
        let rates = self.machine.mechanism().rates();
        let outputs = self.outputs().len();
        let mut tree = RegressorBlock::new(self.tree.layout().clone(), n);
        let mut tree_weights = RegressorBlock::new(self.tree.layout().clone(), n);
        tree_weights.set_samples(n);
        for rate in 0..rates {
            for k in 0..self.tree.layout().columns(rate).len() {
                tree_weights.column_mut(rate, k).fill(0.0);
            }
        }
        let mut by = MotionAdjoint::new(rates, rates, n);
        // What the weights of an output make of the efforts of the tree: `effort[(output * rates + rate) * n + s]`.
        let mut effort = vec![0.0; outputs * rates * n];
        let pressed = self.pressed(motion);
        expanded.with_block(motion, &pressed.channels(), |block| {
            self.tree.regressor(block, shape, &mut tree);
            for (output, terms) in self.fold.terms.iter().enumerate() {
                for (k, terms) in terms.iter().enumerate() {
                    let weight = weights.column(output, k);
                    for term in terms {
                        let to = tree_weights.column_mut(term.rate, term.column);
                        expanded.add(output, term.rate, weight, to);
                        let column = tree.column(term.rate, term.column);
                        let to = &mut effort[(output * rates + term.rate) * n..][..n];
                        for ((t, w), y) in to.iter_mut().zip(weight).zip(column) {
                            *t += w * y;
                        }
                    }
                }
            }
            self.tree.regressor_adjoint(block, shape, &tree_weights, &mut by);
        });
        let work = |sample: usize| {
            let of_output = |output: usize| {
                let tree = (0..rates).map(|r| effort[(output * rates + r) * n + sample]).collect();
                let asked = (0..outputs).map(|o| f64::from(u8::from(o == output))).collect();
                (tree, asked)
            };
            (0..outputs).map(of_output).collect()
        };
        self.carry_all(&expanded, &poses, &by, work, out);
    }

    fn expand_poses(&self, motion: &MotionBlock<'_>) -> (Expanded, Vec<Option<PoseWorkspace>>) {
        assert_eq!(
            self.machine.driven().len(),
            self.machine.mobility(),
            "derivatives of efforts that drives share out among themselves"
        );
        self.expand_keeping(motion)
    }

    /// The motion of all joints with its poses; `None` where there is none.
    pub(super) fn expand_keeping(&self, motion: &MotionBlock<'_>) -> (Expanded, Vec<Option<PoseWorkspace>>) {
        let mut poses = Vec::with_capacity(motion.samples);
        let expanded =
            self.expand_with(motion, |_, _, pose, fault| poses.push(fault.is_none().then(|| pose.clone())));
        (expanded, poses)
    }

    /// Carries derivatives by the motion of all joints to the independent ones, and adds what projections change by.
    ///
    /// `work(sample)`: pairs of efforts of the tree and weights of the outputs.
    pub(super) fn carry_all(
        &self,
        expanded: &Expanded,
        poses: &[Option<PoseWorkspace>],
        by: &MotionAdjoint,
        work: impl Fn(usize) -> Vec<(Vec<f64>, Vec<f64>)>,
        out: &mut MotionAdjoint,
    ) {
        let machine = &self.machine;
        let (n, d, rates) = (expanded.samples, machine.mobility(), machine.mechanism().rates());
        let mut memory: CarryWorkspace = machine.carry_workspace();
        let mut to = [vec![0.0; d], vec![0.0; d], vec![0.0; d]];
        let at = |values: &[f64], sample: usize| -> Vec<f64> {
            (0..rates).map(|r| values[r * n + sample]).collect()
        };
        for (sample, pose) in poses.iter().enumerate() {
            let Some(pose) = pose else {
                for to in [&mut out.q, &mut out.dq, &mut out.ddq] {
                    (0..d).for_each(|k| to[k * n + sample] = f64::NAN);
                }
                continue;
            };
            let work: Vec<(Vec<f64>, Vec<f64>)> = work(sample)
                .into_iter()
                .map(|(tree, asked)| self.work_at(expanded, pose, sample, tree, &asked))
                .collect();
            let seeds = Seeds {
                dq: &at(&expanded.dq, sample),
                ddq: &at(&expanded.ddq, sample),
                by_q: &at(&by.q, sample),
                by_dq: &at(&by.dq, sample),
                by_ddq: &at(&by.ddq, sample),
                work: &work,
            };
            let [to_q, to_dq, to_ddq] = &mut to;
            machine.carry(pose, &seeds, &mut memory, [to_q, to_dq, to_ddq]);
            for (sum, part) in [&mut out.q, &mut out.dq, &mut out.ddq].into_iter().zip(&to) {
                part.iter().enumerate().for_each(|(k, x)| sum[k * n + sample] += x);
            }
        }
    }

    /// Multipliers of efforts of the tree, and the rates of the motion in which the drives move by `asked`.
    fn work_at(
        &self,
        expanded: &Expanded,
        pose: &PoseWorkspace,
        sample: usize,
        tree: Vec<f64>,
        asked: &[f64],
    ) -> (Vec<f64>, Vec<f64>) {
        let machine = &self.machine;
        let rates: Vec<f64> = (0..tree.len())
            .map(|r| asked.iter().enumerate().map(|(o, u)| expanded.share(o, r)[sample] * u).sum())
            .collect();
        let mut dependent: Vec<f64> = machine.dependent().iter().map(|r| tree[*r]).collect();
        for (output, rate) in machine.driven().iter().enumerate() {
            if let Ok(k) = machine.dependent().binary_search(rate) {
                let effort = (0..tree.len()).map(|r| expanded.share(output, r)[sample] * tree[r]);
                dependent[k] -= effort.sum::<f64>();
            }
        }
        let mut multipliers = vec![0.0; machine.conditions()];
        machine.multipliers(pose, &mut dependent, &mut multipliers);
        (multipliers, rates)
    }
}
