//! Blocks of samples, several at a time.

use super::{Dynamics, State, inverse_dynamics, regressor};
use crate::motion_block::MotionBlock;
use dynid_algebra::scalar::{LANES, LaneTask, Scalar, run_on_wide_lanes};
use dynid_algebra::spatial::Vec3;

/// Where the entries of a regressor block go: slot `k` holds one entry of all samples.
#[derive(Clone, Debug)]
pub struct Slots {
    /// First of ten slots of every carried axis.
    by_axis: Vec<usize>,
}

impl Slots {
    /// `first(rate, body)` is the first of the ten consecutive slots of a joint rate's row and a body's parameters.
    pub fn new(dynamics: &Dynamics, first: impl Fn(usize, usize) -> usize) -> Self {
        let mut by_axis = vec![0; dynamics.tree.axis_rate.len()];
        for node in &dynamics.tree.nodes {
            let rates = &dynamics.tree.axis_rate[node.carried()];
            for (slot, rate) in by_axis[node.carried()].iter_mut().zip(rates) {
                *slot = first(*rate, node.body);
            }
        }
        Slots { by_axis }
    }

    /// First of the ten slots of a carried axis.
    #[inline(always)]
    pub(super) fn of_axis(&self, axis: usize) -> usize {
        self.by_axis[axis]
    }
}

struct RegressorTask<'a> {
    dynamics: &'a Dynamics,
    motion: &'a MotionBlock<'a>,
    slots: &'a Slots,
    stride: usize,
    out: &'a mut [f64],
}

/// First samples of the groups of lanes that cover a block; the last group may overlap the one before.
#[inline(always)]
fn groups(samples: usize) -> impl Iterator<Item = usize> {
    (0..samples.div_ceil(LANES)).map(move |g| (g * LANES).min(samples - LANES))
}

#[inline(always)]
pub(super) fn load_all<S: Scalar>(
    from: &[f64],
    stride: usize,
    sample: usize,
    to: &mut [S],
    load: &impl Fn(&[f64]) -> S,
) {
    for (c, value) in to.iter_mut().enumerate() {
        *value = load(&from[c * stride + sample..]);
    }
}

#[inline(always)]
pub(super) fn load_gravity<S: Scalar>(
    dynamics: &Dynamics,
    motion: &MotionBlock<'_>,
    sample: usize,
    load: &impl Fn(&[f64]) -> S,
) -> Vec3<S> {
    match motion.gravity {
        None => Vec3::constant(dynamics.gravity.0),
        Some(g) => {
            let at = |c: usize| load(&g[c * motion.stride + sample..]);
            Vec3([at(0), at(1), at(2)])
        }
    }
}

impl LaneTask for RegressorTask<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let RegressorTask { dynamics, motion, slots, stride, out } = self;
        let tree = &dynamics.tree;
        let mut work = regressor::RegressorWorkspace::<S>::new(tree);
        let mut q = vec![S::zero(); tree.positions];
        let mut dq = vec![S::zero(); tree.rates];
        let mut ddq = vec![S::zero(); tree.rates];
        for sample in groups(motion.samples) {
            load_all(motion.q, motion.stride, sample, &mut q, &load);
            load_all(motion.dq, motion.stride, sample, &mut dq, &load);
            load_all(motion.ddq, motion.stride, sample, &mut ddq, &load);
            let gravity = load_gravity(dynamics, motion, sample, &load);
            regressor::sweep(
                tree,
                (&q, &dq, &ddq),
                gravity,
                &slots.by_axis,
                &mut work,
                |slot, columns, entries| {
                    for (column, value) in columns.iter().zip(&entries) {
                        store(*value, &mut out[(slot + column) * stride + sample..]);
                    }
                },
            );
        }
    }
}

struct InverseDynamicsTask<'a> {
    dynamics: &'a Dynamics,
    motion: &'a MotionBlock<'a>,
    inertias: &'a [f64],
    stride: usize,
    effort: &'a mut [f64],
}

impl LaneTask for InverseDynamicsTask<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let InverseDynamicsTask { dynamics, motion, inertias, stride, effort } = self;
        let tree = &dynamics.tree;
        let mut work = inverse_dynamics::InverseDynamicsWorkspace::<S>::new(tree);
        work.load_inertias(tree, inertias, S::from_f64);
        let mut q = vec![S::zero(); tree.positions];
        let mut dq = vec![S::zero(); tree.rates];
        let mut ddq = vec![S::zero(); tree.rates];
        let mut out = vec![S::zero(); tree.rates];
        for sample in groups(motion.samples) {
            load_all(motion.q, motion.stride, sample, &mut q, &load);
            load_all(motion.dq, motion.stride, sample, &mut dq, &load);
            load_all(motion.ddq, motion.stride, sample, &mut ddq, &load);
            let gravity = load_gravity(dynamics, motion, sample, &load);
            inverse_dynamics::sweep(tree, (&q, &dq, &ddq), gravity, &mut work, &mut out);
            for (k, value) in out.iter().enumerate() {
                store(*value, &mut effort[k * stride + sample..]);
            }
        }
    }
}

impl Dynamics {
    /// Efforts of all samples of a block: `effort[k * stride + s]`, rate `k`, sample `s`.
    ///
    /// # Panics
    /// If a slice is too short.
    pub fn inverse_dynamics_block(
        &self,
        motion: &MotionBlock<'_>,
        inertias: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        assert_eq!(inertias.len(), 10 * self.bodies, "length of inertias");
        assert!(stride >= motion.samples, "stride shorter than the block");
        let mut effort = effort;
        if motion.samples >= LANES && self.follows.is_none() {
            let task = InverseDynamicsTask { dynamics: self, motion, inertias, stride, effort };
            let Some(left) = run_on_wide_lanes(task) else { return };
            effort = left.effort;
        }
        let mut work = self.workspace();
        let mut out = vec![0.0; self.rates];
        self.each_sample(motion, |sample, state| {
            self.inverse_dynamics(state, inertias, &mut work, &mut out);
            for (k, value) in out.iter().enumerate() {
                effort[k * stride + sample] = *value;
            }
        });
    }

    /// Regressor entries of all samples of a block, `out[slot * stride + s]`, at joint level (mimic coupling is left to
    /// the caller). Slots that no entry goes to are not written.
    pub fn regressor_block(&self, motion: &MotionBlock<'_>, slots: &Slots, stride: usize, out: &mut [f64]) {
        debug_assert!(self.follows.is_none(), "coupled joints are folded by the caller");
        let mut out = out;
        if motion.samples >= LANES {
            let Some(left) = run_on_wide_lanes(RegressorTask { dynamics: self, motion, slots, stride, out })
            else {
                return;
            };
            out = left.out;
        }
        let mut work = regressor::RegressorWorkspace::new(&self.tree);
        self.each_sample(motion, |sample, state| {
            let gravity = self.gravity_of(state);
            let q = (state.q, state.dq, state.ddq);
            regressor::sweep(&self.tree, q, gravity, &slots.by_axis, &mut work, |slot, columns, entries| {
                for (column, value) in columns.iter().zip(&entries) {
                    out[(slot + column) * stride + sample] = *value;
                }
            });
        });
    }

    fn each_sample(&self, motion: &MotionBlock<'_>, mut work: impl FnMut(usize, &State<'_, f64>)) {
        let mut q = vec![0.0; self.positions];
        let mut dq = vec![0.0; self.rates];
        let mut ddq = vec![0.0; self.rates];
        for sample in 0..motion.samples {
            load_all(motion.q, motion.stride, sample, &mut q, &|from| from[0]);
            load_all(motion.dq, motion.stride, sample, &mut dq, &|from| from[0]);
            load_all(motion.ddq, motion.stride, sample, &mut ddq, &|from| from[0]);
            let gravity =
                motion.gravity.is_some().then(|| load_gravity(self, motion, sample, &|from| from[0]));
            work(sample, &State { q: &q, dq: &dq, ddq: &ddq, gravity });
        }
    }
}
