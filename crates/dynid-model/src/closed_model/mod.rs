//! The effort model of a closed mechanism: efforts of its drives, linear in the parameters of bodies and elements.

mod adjoint;
mod expand;
mod fold;
mod joint_motion;
mod loads;
mod paths;
mod random_motion;
mod reactions;

use std::sync::Arc;

use crate::closed::{ClosedMechanism, Drives, PoseError};
use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
use crate::element::JointInfo;
use crate::parameter::ParameterTable;
use crate::random_motion::RandomMotion;
use crate::tree_model::TreeModel;
use fold::Fold;
pub use joint_motion::JointMotion;
use loads::Loads;
pub use loads::{JointLoad, LoadError, LoadGroup, LoadReference};
use paths::Paths;
pub use reactions::{Reaction, Reactions};

/// Rigid bodies and joint elements of a tree whose loops are closed.
///
/// Coordinates of a motion are the [independent](ClosedMechanism::independent) ones, outputs the
/// [driven](ClosedMechanism::driven) joints. Elements may act at any joint of the tree. With tree efforts
/// `t = W_t · linear + offset_t` and the velocity map `G` at the pose of a sample,
///
/// ```text
/// effort = S⁺ᵀ-projection of Gᵀ t,   Gᵀ S effort = Gᵀ t
/// ```
///
/// Poses are followed from the home position to the first sample of a block, then from sample to sample. Where there is no
/// closed pose, or a singular one, all that would be computed there is not a number; [`ClosedModel::follow`] says where and why.
#[derive(Debug)]
pub struct ClosedModel {
    tree: TreeModel,
    machine: Arc<ClosedMechanism>,
    drives: Drives,
    outputs: Vec<Output>,
    joints: Vec<JointInfo>,
    fold: Fold,
    /// Channels that a motion must bring.
    channels: Vec<String>,
    loads: Option<Loads>,
    paths: Arc<Paths>,
}

/// The sample of a motion at which poses cannot be followed, and why.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("sample {sample}: {fault}")]
pub struct PathError {
    /// Sample, from 0.
    pub sample: usize,
    /// Why.
    pub fault: PoseError,
}

impl ClosedModel {
    /// Closes the loops of a model of the tree.
    ///
    /// # Panics
    /// If the tree's mechanism is not that of `machine` (but for inertias and gravity), or has coordinates without bodies.
    pub fn new(tree: TreeModel, machine: impl Into<Arc<ClosedMechanism>>) -> Self {
        let machine = machine.into();
        assert!(tree.coordinates().is_empty(), "a closed mechanism with coordinates without bodies");
        let machine = if tree.mechanism() == machine.mechanism() {
            machine
        } else {
            Arc::new(machine.as_ref().clone().with_mechanism(tree.mechanism().clone()))
        };
        let outputs = machine.driven().iter().map(|rate| tree.outputs()[*rate].clone()).collect();
        let joints = machine.driven().iter().enumerate().map(|(k, rate)| JointInfo {
            number: k + 1,
            position: k,
            ..tree.joints()[*rate].clone()
        });
        ClosedModel {
            drives: Drives::new(&machine),
            fold: Fold::new(&tree, &machine, &[]),
            channels: tree.channels().to_vec(),
            joints: joints.collect(),
            loads: None,
            paths: Arc::default(),
            outputs,
            machine,
            tree,
        }
    }

    /// The model of the tree.
    pub fn tree(&self) -> &TreeModel {
        &self.tree
    }

    /// Driven joints.
    pub fn joints(&self) -> &[JointInfo] {
        &self.joints
    }

    /// The closed mechanism.
    pub fn machine(&self) -> &Arc<ClosedMechanism> {
        &self.machine
    }

    /// Returns the closures and loads around a changed model of the tree, whose elements keep their columns.
    pub(crate) fn map_tree(self, change: impl FnOnce(TreeModel) -> TreeModel) -> Self {
        let (loads, paths) = (self.loads, self.paths);
        let mut out = ClosedModel::new(change(self.tree), self.machine);
        // Elements move no joint.
        out.paths = paths;
        if let Some(loads) = loads {
            out.feed(loads);
        }
        out
    }
}

impl EffortModel for ClosedModel {
    fn outputs(&self) -> &[Output] {
        &self.outputs
    }

    fn parameters(&self) -> &ParameterTable {
        self.tree.parameters()
    }

    fn layout(&self) -> &Arc<RegressorLayout> {
        &self.fold.layout
    }

    fn channels(&self) -> &[String] {
        &self.channels
    }

    fn signals(&self) -> &[String] {
        self.tree.signals()
    }

    fn remember(
        &self,
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        history: &mut History,
        stride: usize,
        out: &mut [f64],
    ) {
        let (path, pressed) = self.prepared(motion);
        let expanded = &path.expanded;
        expanded.with_block(motion, &pressed.channels(), |block| {
            self.tree.remember(block, step_s, shape, history, stride, out);
        });
    }

    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion {
        self.random_states(samples, seed)
    }

    fn dimensions(&self) -> (usize, usize) {
        let mobility = self.machine.mobility();
        (mobility, mobility)
    }

    /// Every sign that elements take of the speed of an independent coordinate. Signs of other speeds are not told.
    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        let rate = self.machine.driven()[output];
        let independent = self.machine.independent();
        let own = |r: &usize| independent.iter().position(|i| i == r);
        let speeds = self.tree.reversal_speeds(rate).into_iter().filter_map(|speed| {
            speed.iter().map(|(rate, factor)| Some((own(rate)?, *factor))).collect::<Option<Vec<_>>>()
        });
        speeds.collect()
    }

    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        let (path, pressed) = self.prepared_linearised(motion);
        let expanded = &path.expanded;
        let mut tree = RegressorBlock::new(self.tree.layout().clone(), motion.samples);
        expanded
            .with_block(motion, &pressed.channels(), |block| self.tree.regressor(block, shape, &mut tree));
        self.fold.regressor(expanded, &tree, out);
        pressed.linearise(self, motion, expanded, out);
    }

    fn shaped_columns(&self) -> &[(usize, usize)] {
        &self.fold.shaped
    }

    fn shape_dependence(&self) -> &[(usize, usize)] {
        &self.fold.dependence
    }

    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        let n = motion.samples;
        let (path, pressed) = self.prepared(motion);
        let expanded = &path.expanded;
        let wanted = |slice: &[f64], columns: usize| if slice.is_empty() { 0 } else { columns * n };
        let mut tree_values = vec![0.0; wanted(values, self.tree.shaped_columns().len())];
        let mut tree_derivatives = vec![0.0; wanted(derivatives, self.tree.shape_dependence().len())];
        expanded.with_block(motion, &pressed.channels(), |block| {
            self.tree.shaped(block, shape, n, &mut tree_values, &mut tree_derivatives);
        });
        self.fold.shaped_values(expanded, &tree_values, stride, values);
        self.fold.shaped_derivatives(expanded, &tree_derivatives, stride, derivatives);
    }

    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        let n = motion.samples;
        if self.loads.as_ref().is_some_and(Loads::is_linearised) {
            let mut block = RegressorBlock::new(self.fold.layout.clone(), n);
            self.regressor(motion, shape, &mut block);
            for output in 0..self.outputs.len() {
                effort[output * stride..][..n].copy_from_slice(&block.effort(output, linear));
            }
            return;
        }
        let (path, pressed) = self.prepared(motion);
        let expanded = &path.expanded;
        let rates = self.machine.mechanism().rates();
        let mut tree = vec![0.0; rates * n];
        expanded.with_block(motion, &pressed.channels(), |block| {
            self.tree.efforts(block, shape, linear, n, &mut tree);
        });
        for output in 0..self.outputs.len() {
            let to = &mut effort[output * stride..][..n];
            to.fill(0.0);
            for rate in self.fold.rates(output) {
                expanded.add(output, rate, &tree[rate * n..][..n], to);
            }
        }
    }

    /// # Panics
    /// Also if there are more drives than free motions.
    fn effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        self.add_effort_adjoint(motion, (shape, linear), (stride, weights), out);
    }

    /// # Panics
    /// Also if there are more drives than free motions.
    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        self.add_regressor_adjoint(motion, shape, weights, out);
    }
}
