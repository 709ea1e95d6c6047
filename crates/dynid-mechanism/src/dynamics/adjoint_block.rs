//! Adjoints over blocks of samples.

use super::adjoint::{AdjointWorkspace, Moments, effort_sweep, regressor_sweep};
use super::block::{load_all, load_gravity};
use super::groups::{GroupTask, groups, run};
use super::tree::Node;
use super::{Dynamics, MotionBlock, Slots};
use dynid_algebra::scalar::{LANES, Scalar};

/// Derivatives of a scalar with respect to the motion of a block.
///
/// Entry of coordinate `c`, sample `s` is at `c * samples + s`, whatever the stride of the block.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionAdjoint {
    /// Number of samples.
    pub samples: usize,
    /// By positions, per rad or m.
    pub q: Vec<f64>,
    /// By rates.
    pub dq: Vec<f64>,
    /// By accelerations.
    pub ddq: Vec<f64>,
}

impl MotionAdjoint {
    /// Zeros for a model with that many position entries and rates.
    pub fn new(positions: usize, rates: usize, samples: usize) -> Self {
        MotionAdjoint {
            samples,
            q: vec![0.0; positions * samples],
            dq: vec![0.0; rates * samples],
            ddq: vec![0.0; rates * samples],
        }
    }

    /// Sets all derivatives to zero.
    pub fn clear(&mut self) {
        self.q.fill(0.0);
        self.dq.fill(0.0);
        self.ddq.fill(0.0);
    }

    /// Checks sizes against those of the motion that it is the adjoint of.
    ///
    /// # Panics
    /// If they differ.
    pub fn check(&self, (positions, rates): (usize, usize), samples: usize) {
        assert_eq!(self.samples, samples, "samples of the adjoint");
        assert_eq!(self.q.len(), positions * samples, "positions of the adjoint");
        assert_eq!(self.dq.len(), rates * samples, "rates of the adjoint");
        assert_eq!(self.ddq.len(), rates * samples, "accelerations of the adjoint");
    }
}

#[inline(always)]
fn add_all<S: Scalar>(
    from: &[Vec<S>; 3],
    (sample, done): (usize, usize),
    width: usize,
    load: &impl Fn(&[f64]) -> S,
    store: &impl Fn(S, &mut [f64]),
    to: &mut MotionAdjoint,
) {
    let stride = to.samples;
    for (values, to) in from.iter().zip([&mut to.q, &mut to.dq, &mut to.ddq]) {
        for (c, value) in values.iter().enumerate() {
            let to = &mut to[c * stride + sample..][..width];
            if done == 0 {
                store(load(to) + *value, to);
            } else {
                let mut added = [0.0; LANES];
                store(*value, &mut added);
                for (t, a) in to.iter_mut().zip(added).skip(done) {
                    *t += a;
                }
            }
        }
    }
}

struct EffortAdjoint<'a> {
    dynamics: &'a Dynamics,
    motion: &'a MotionBlock<'a>,
    inertias: &'a [f64],
    stride: usize,
    weights: &'a [f64],
    out: &'a mut MotionAdjoint,
}

impl GroupTask for EffortAdjoint<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, width: usize, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let EffortAdjoint { dynamics, motion, inertias, stride, weights, out } = self;
        let tree = &dynamics.tree;
        let mut work = AdjointWorkspace::<S>::new(tree, tree.nodes.len());
        let (bodies, _) = inertias.as_chunks::<10>();
        let of_node = |node: &Node| Moments::new(node.columns.map(|c| S::from_f64(bodies[node.body][c])));
        let moments: Vec<Moments<S>> = tree.nodes.iter().map(of_node).collect();
        let mut q = vec![S::zero(); tree.positions];
        let [mut dq, mut ddq, mut u] = [(); 3].map(|()| vec![S::zero(); tree.rates]);
        for group in groups(motion.samples, width) {
            let sample = group.0;
            load_all(motion.q, motion.stride, sample, &mut q, &load);
            load_all(motion.dq, motion.stride, sample, &mut dq, &load);
            load_all(motion.ddq, motion.stride, sample, &mut ddq, &load);
            load_all(weights, stride, sample, &mut u, &load);
            let gravity = load_gravity(dynamics, motion, sample, &load);
            effort_sweep(tree, (&q, &dq, &ddq), gravity, &u, &moments, &mut work);
            add_all(&work.out, group, width, &load, &store, out);
        }
    }
}

struct RegressorAdjoint<'a> {
    dynamics: &'a Dynamics,
    motion: &'a MotionBlock<'a>,
    slots: &'a Slots,
    stride: usize,
    weights: &'a [f64],
    out: &'a mut MotionAdjoint,
}

impl GroupTask for RegressorAdjoint<'_> {
    #[inline(always)]
    fn run<S: Scalar>(self, width: usize, load: impl Fn(&[f64]) -> S, store: impl Fn(S, &mut [f64])) {
        let RegressorAdjoint { dynamics, motion, slots, stride, weights, out } = self;
        let tree = &dynamics.tree;
        let mut work = AdjointWorkspace::<S>::new(tree, tree.axis_rate.len());
        let mut q = vec![S::zero(); tree.positions];
        let [mut dq, mut ddq] = [(); 2].map(|()| vec![S::zero(); tree.rates]);
        for group in groups(motion.samples, width) {
            let sample = group.0;
            load_all(motion.q, motion.stride, sample, &mut q, &load);
            load_all(motion.dq, motion.stride, sample, &mut dq, &load);
            load_all(motion.ddq, motion.stride, sample, &mut ddq, &load);
            let gravity = load_gravity(dynamics, motion, sample, &load);
            let weights_of = |axis: usize, node: &Node| {
                let first = slots.of_axis(axis);
                node.columns.map(|c| load(&weights[(first + c) * stride + sample..]))
            };
            regressor_sweep(tree, (&q, &dq, &ddq), gravity, weights_of, &mut work);
            add_all(&work.out, group, width, &load, &store, out);
        }
    }
}

impl Dynamics {
    /// Adds to `out` the derivatives of `Σ_k Σ_s weights[k * stride + s] · effort_k(s)`, with the efforts of
    /// [`Dynamics::inverse_dynamics_block`]; joint level, mimic coupling is left to the caller.
    ///
    /// Source: Featherstone 2008 (the recursion, here accumulated in reverse).
    pub fn effort_adjoint_block(
        &self,
        motion: &MotionBlock<'_>,
        inertias: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        debug_assert!(self.follows.is_none(), "coupled joints are folded by the caller");
        run(motion.samples, EffortAdjoint { dynamics: self, motion, inertias, stride, weights, out });
    }

    /// Adds to `out` the derivatives of `Σ weights ∘ Y`, entry of slot `k` and sample `s` at `weights[k * stride + s]`;
    /// joint level, mimic coupling is left to the caller.
    pub fn regressor_adjoint_block(
        &self,
        motion: &MotionBlock<'_>,
        slots: &Slots,
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        debug_assert!(self.follows.is_none(), "coupled joints are folded by the caller");
        run(motion.samples, RegressorAdjoint { dynamics: self, motion, slots, stride, weights, out });
    }
}
