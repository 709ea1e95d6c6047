//! Forces in joints and cuts over blocks of samples, linear in the parameters.

use std::sync::Arc;

use super::ClosedModel;
use super::expand::Expanded;
use crate::closed::PoseWorkspace;
use crate::dynamics::MotionBlock;
use crate::dynamics::motion::BodyMotion;
use crate::effort_model::{EffortModel, RegressorBlock, RegressorLayout};
use dynid_algebra::spatial::Vec3;

/// A component of a force or couple that the mechanism carries inside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reaction {
    /// Of the wrench that the parent exerts on a body through its joint, about the joint frame's origin, in its axes.
    Joint {
        /// Body.
        body: usize,
        /// 0 to 2: force along x, y, z, N; 3 to 5: moment, N m.
        component: usize,
    },
    /// Multiplier of a condition.
    Multiplier {
        /// Number of the condition.
        condition: usize,
    },
}

/// Some reactions of a closed model, and which parameters act on them.
#[derive(Clone, Debug)]
pub struct Reactions {
    list: Vec<Reaction>,
    /// Nodes that hang on each reaction's joint.
    hanging: Vec<Vec<usize>>,
    /// Bodies of these nodes.
    bodies: Vec<Vec<usize>>,
    layout: Arc<RegressorLayout>,
}

impl Reactions {
    /// The reactions, in the order of the rows.
    pub fn list(&self) -> &[Reaction] {
        &self.list
    }

    /// Which parameters act on which reaction.
    pub fn layout(&self) -> &Arc<RegressorLayout> {
        &self.layout
    }
}

/// How reactions over a block follow from efforts of the tree and from inertias.
#[derive(Debug)]
pub(super) struct ReactionShares {
    reactions: Arc<Reactions>,
    samples: usize,
    rates: usize,
    /// `shares[(k * rates + r) * samples + s]`: part of the effort of rate `r` in reaction `k`.
    shares: Vec<f64>,
    /// Per reaction: ten entries per hanging node, `[(10 * place + c) * samples + s]`.
    inertial: Vec<Vec<f64>>,
}

impl ClosedModel {
    /// Prepares reactions for [`ClosedModel::reaction_regressor`].
    ///
    /// # Panics
    /// If a body, component or condition does not exist.
    pub fn reactions(&self, list: &[Reaction]) -> Reactions {
        let machine = &self.machine;
        let tree = self.tree.layout();
        let mut hanging = Vec::with_capacity(list.len());
        let mut columns = Vec::with_capacity(list.len());
        // Efforts of rates that no reaction feels are the drives' own.
        let felt: Vec<usize> = (0..machine.mechanism().rates())
            .filter(|r| !machine.drives_are_independent() || machine.dependent().contains(r))
            .collect();
        for reaction in list {
            let nodes = match *reaction {
                Reaction::Joint { body, component } => {
                    assert!(component < 6, "component {component} of a wrench");
                    machine.hanging(body)
                }
                Reaction::Multiplier { condition } => {
                    assert!(condition < machine.conditions(), "condition {condition}");
                    Vec::new()
                }
            };
            let mut acting: Vec<usize> = felt.iter().flat_map(|r| tree.columns(*r).iter().copied()).collect();
            acting.extend(nodes.iter().flat_map(|n| {
                let first = 10 * machine.body_of(*n);
                first..first + 10
            }));
            acting.sort_unstable();
            acting.dedup();
            hanging.push(nodes);
            columns.push(acting);
        }
        let layout = Arc::new(RegressorLayout::new(columns, tree.parameters()));
        let body = |nodes: &Vec<usize>| nodes.iter().map(|n| machine.body_of(*n)).collect();
        Reactions { list: list.to_vec(), bodies: hanging.iter().map(body).collect(), hanging, layout }
    }

    /// Regressors of reactions, and of efforts, over a block: both are linear in the parameters.
    ///
    /// `out` has the layout of the reactions, `effort` that of the model. Multipliers that are
    /// [not determined](crate::closed::ClosedMechanism::is_determined) are those of least norm.
    ///
    /// # Panics
    /// Panics as [`EffortModel::regressor`] does.
    pub fn reaction_regressor(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        reactions: &Reactions,
        effort: &mut RegressorBlock,
        out: &mut RegressorBlock,
    ) {
        let (expanded, shares) = self.expand_reactions(motion, &Arc::new(reactions.clone()));
        let pressed = self.pressed(motion);
        let mut tree = RegressorBlock::new(self.tree.layout().clone(), motion.samples);
        expanded
            .with_block(motion, &pressed.channels(), |block| self.tree.regressor(block, shape, &mut tree));
        self.fold.regressor(&expanded, &tree, effort);
        pressed.linearise(self, motion, &expanded, effort);
        shares.regressor(&tree, out);
    }

    pub(super) fn expand_reactions(
        &self,
        motion: &MotionBlock<'_>,
        reactions: &Arc<Reactions>,
    ) -> (Expanded, ReactionShares) {
        let machine = &self.machine;
        let (samples, rates) = (motion.samples, machine.mechanism().rates());
        let mut shares = ReactionShares {
            samples,
            rates,
            shares: vec![0.0; reactions.list.len() * rates * samples],
            inertial: reactions.hanging.iter().map(|h| vec![0.0; 10 * h.len() * samples]).collect(),
            reactions: reactions.clone(),
        };
        let mut memory = Memory::new(self, reactions.list.len());
        let expanded = self.expand_with(motion, |sample, expanded, pose, fault| {
            if fault.is_some() {
                let nan = |v: &mut Vec<f64>| {
                    v.iter_mut().skip(sample).step_by(samples).for_each(|x| *x = f64::NAN);
                };
                nan(&mut shares.shares);
                shares.inertial.iter_mut().for_each(nan);
                return;
            }
            shares.take(self, motion, expanded, (sample, pose), &mut memory);
        });
        (expanded, shares)
    }
}

/// Scratch of [`ReactionShares::take`].
struct Memory {
    motions: Vec<BodyMotion<f64>>,
    right: Vec<f64>,
    /// One column per reaction.
    rights: Vec<f64>,
    steps: Vec<f64>,
    by_rate: Vec<f64>,
    dq: Vec<f64>,
    ddq: Vec<f64>,
}

impl Memory {
    fn new(model: &ClosedModel, reactions: usize) -> Self {
        let rates = model.machine.mechanism().rates();
        Memory {
            motions: Vec::new(),
            right: vec![0.0; model.machine.conditions()],
            rights: vec![0.0; model.machine.conditions() * reactions],
            steps: vec![0.0; model.machine.dependent().len() * reactions],
            by_rate: vec![0.0; rates],
            dq: vec![0.0; rates],
            ddq: vec![0.0; rates],
        }
    }
}

impl ReactionShares {
    /// How many numbers it holds.
    pub(super) fn numbers(&self) -> usize {
        self.shares.len() + self.inertial.iter().map(Vec::len).sum::<usize>()
    }

    fn take(
        &mut self,
        model: &ClosedModel,
        motion: &MotionBlock<'_>,
        expanded: &Expanded,
        (sample, pose): (usize, &PoseWorkspace),
        memory: &mut Memory,
    ) {
        let (machine, n) = (&model.machine, self.samples);
        let Memory { motions, right, rights, steps, by_rate, dq, ddq } = memory;
        let count = self.reactions.list.len();
        if count == 0 {
            return;
        }
        if self.reactions.hanging.iter().any(|h| !h.is_empty()) {
            for (rate, (v, a)) in dq.iter_mut().zip(ddq.iter_mut()).enumerate() {
                (*v, *a) = (expanded.dq[rate * n + sample], expanded.ddq[rate * n + sample]);
            }
            let gravity = match motion.gravity {
                None => machine.mechanism().gravity(),
                Some(g) => Vec3([0, 1, 2].map(|c| g[c * motion.stride + sample])),
            };
            machine.body_motions(pose, (dq, ddq), gravity, motions);
        }
        for (k, reaction) in self.reactions.list.iter().enumerate() {
            match *reaction {
                Reaction::Joint { component, .. } => {
                    let hanging = &self.reactions.hanging[k];
                    for (place, node) in hanging.iter().enumerate() {
                        let entries = machine.inertial_entries(pose, motions, (hanging[0], *node), component);
                        for (c, entry) in entries.iter().enumerate() {
                            self.inertial[k][(10 * place + c) * n + sample] = *entry;
                        }
                    }
                    machine.closure_entries(pose, hanging, component, right);
                    right.iter_mut().for_each(|x| *x = -*x);
                }
                Reaction::Multiplier { condition } => {
                    right.fill(0.0);
                    right[condition] = 1.0;
                }
            }
            rights.iter_mut().skip(k).step_by(count).zip(&*right).for_each(|(to, x)| *to = *x);
        }
        machine.solve_many(pose, count, rights, steps);
        for k in 0..count {
            by_rate.fill(0.0);
            for (rate, z) in machine.dependent().iter().zip(steps.iter().skip(k).step_by(count)) {
                by_rate[*rate] = *z;
            }
            // What drives on dependent coordinates take off.
            let mut taken: Vec<(usize, f64)> = Vec::new();
            for (output, rate) in machine.driven().iter().enumerate() {
                if by_rate[*rate] != 0.0 {
                    taken.push((output, by_rate[*rate]));
                }
            }
            for (rate, entry) in by_rate.iter_mut().enumerate() {
                for (output, z) in &taken {
                    *entry -= z * expanded.share(*output, rate)[sample];
                }
                self.shares[(k * self.rates + rate) * n + sample] = *entry;
            }
        }
    }

    pub(super) fn share(&self, k: usize, rate: usize) -> &[f64] {
        &self.shares[(k * self.rates + rate) * self.samples..][..self.samples]
    }

    /// Regressors of the reactions from the regressor of the tree.
    pub(super) fn regressor(&self, tree: &RegressorBlock, out: &mut RegressorBlock) {
        let layout = &self.reactions.layout;
        out.start(layout, self.samples);
        for k in 0..self.reactions.list.len() {
            for place in 0..layout.columns(k).len() {
                out.column_mut(k, place).fill(0.0);
            }
            let place = |column: &usize| layout.columns(k).binary_search(column).ok();
            for rate in 0..self.rates {
                for (c, column) in tree.layout().columns(rate).iter().enumerate() {
                    if let Some(to) = place(column) {
                        add(out.column_mut(k, to), self.share(k, rate), tree.column(rate, c));
                    }
                }
                add(out.offset_mut(k), self.share(k, rate), tree.offset(rate));
            }
            for (at, entries) in self.inertial[k].chunks_exact(self.samples.max(1)).enumerate() {
                if let Some(to) = place(&self.inertial_column(k, at)) {
                    out.column_mut(k, to).iter_mut().zip(entries).for_each(|(t, x)| *t += x);
                }
            }
        }
    }

    /// Values of one reaction, from efforts of the tree (`tree[rate * samples + s]`) and the inertias.
    pub(super) fn values(&self, k: usize, tree: &[f64], linear: &[f64], to: &mut [f64]) {
        to.fill(0.0);
        for rate in 0..self.rates {
            add(to, self.share(k, rate), &tree[rate * self.samples..][..self.samples]);
        }
        for (at, entries) in self.inertial[k].chunks_exact(self.samples.max(1)).enumerate() {
            let factor = linear[self.inertial_column(k, at)];
            if factor != 0.0 {
                to.iter_mut().zip(entries).for_each(|(t, x)| *t += factor * x);
            }
        }
    }

    /// Parameter column of an inertial entry.
    fn inertial_column(&self, k: usize, at: usize) -> usize {
        10 * self.reactions.bodies[k][at / 10] + at % 10
    }
}

fn add(to: &mut [f64], share: &[f64], from: &[f64]) {
    for ((t, s), x) in to.iter_mut().zip(share).zip(from) {
        *t += s * x;
    }
}
