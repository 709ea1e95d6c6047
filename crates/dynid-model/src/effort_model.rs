//! Effort models: effort that is linear in most of its parameters.

use std::sync::Arc;

use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::mechanism::Mechanism;
use crate::parameter::ParameterTable;
use crate::random_motion::RandomMotion;

/// Which columns of the regressor can differ from zero, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct RegressorLayout {
    /// For every output: the parameter columns that act on it, ascending within the rigid body and the elements.
    columns: Vec<Vec<usize>>,
    /// For every output: its first slot.
    first_slot: Vec<usize>,
    slots: usize,
    parameters: usize,
}

impl RegressorLayout {
    /// From the acting columns of every output and the number of parameters.
    pub fn new(columns: Vec<Vec<usize>>, parameters: usize) -> Self {
        let mut slots = 0;
        let first_slot = columns
            .iter()
            .map(|c| {
                slots += c.len();
                slots - c.len()
            })
            .collect();
        RegressorLayout { columns, first_slot, slots, parameters }
    }

    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.columns.len()
    }

    /// Number of parameters (columns of the whole regressor).
    pub fn parameters(&self) -> usize {
        self.parameters
    }

    /// Parameter columns that act on an output.
    pub fn columns(&self, output: usize) -> &[usize] {
        &self.columns[output]
    }

    /// Slot of a parameter column in an output's row, if it acts there.
    pub(crate) fn slot(&self, output: usize, column: usize) -> Option<usize> {
        self.columns[output].iter().position(|c| *c == column).map(|k| self.first_slot[output] + k)
    }

    pub(crate) fn first_slot(&self, output: usize) -> usize {
        self.first_slot[output]
    }

    /// Number of entries per sample.
    pub fn slots(&self) -> usize {
        self.slots
    }
}

/// Regressor and known effort of a block of samples, stored column after column:
/// `effort(output) = Σ columns · linear + offset(output)`.
#[derive(Debug, Clone)]
pub struct RegressorBlock {
    layout: Arc<RegressorLayout>,
    capacity: usize,
    samples: usize,
    data: Vec<f64>,
    offset: Vec<f64>,
}

impl RegressorBlock {
    /// Room for `capacity` samples.
    pub fn new(layout: Arc<RegressorLayout>, capacity: usize) -> Self {
        // A stride that is a multiple of the page size would map all columns to the same cache sets.
        let capacity = if capacity.is_multiple_of(64) { capacity + 8 } else { capacity };
        let data = vec![0.0; layout.slots * capacity];
        let offset = vec![0.0; layout.outputs() * capacity];
        RegressorBlock { layout, capacity, samples: 0, data, offset }
    }

    /// The layout.
    pub fn layout(&self) -> &RegressorLayout {
        &self.layout
    }

    /// Number of samples in the block.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Distance between columns in [`RegressorBlock::rows`].
    pub fn stride(&self) -> usize {
        self.capacity
    }

    /// Entries of the `k`-th acting column of an output, one per sample.
    pub fn column(&self, output: usize, k: usize) -> &[f64] {
        let slot = self.layout.first_slot[output] + k;
        &self.data[slot * self.capacity..][..self.samples]
    }

    /// All acting columns of an output, [`RegressorBlock::stride`] apart.
    pub fn rows(&self, output: usize) -> &[f64] {
        let first = self.layout.first_slot[output] * self.capacity;
        &self.data[first..first + self.layout.columns[output].len() * self.capacity]
    }

    /// The part of an output's effort that does not depend on linear parameters.
    pub fn offset(&self, output: usize) -> &[f64] {
        &self.offset[output * self.capacity..][..self.samples]
    }

    /// Effort of an output for given linear parameters: `W linear + offset`.
    pub fn effort(&self, output: usize, linear: &[f64]) -> Vec<f64> {
        let mut effort = self.offset(output).to_vec();
        for (k, column) in self.layout.columns[output].iter().enumerate() {
            let factor = linear[*column];
            if factor != 0.0 {
                for (e, w) in effort.iter_mut().zip(self.column(output, k)) {
                    *e += w * factor;
                }
            }
        }
        effort
    }

    /// Entries of a column, to be written: weights for [`EffortModel::regressor_adjoint`].
    pub fn column_mut(&mut self, output: usize, k: usize) -> &mut [f64] {
        let slot = self.layout.first_slot[output] + k;
        &mut self.data[slot * self.capacity..][..self.samples]
    }

    /// Makes this a block of `samples` samples; entries are to be written by the caller and are arbitrary until then.
    ///
    /// # Panics
    /// If the block has no room for them.
    pub fn set_samples(&mut self, samples: usize) {
        assert!(samples <= self.capacity, "{samples} samples in a block of {}", self.capacity);
        self.samples = samples;
    }

    pub(crate) fn data(&self) -> &[f64] {
        &self.data
    }

    pub(crate) fn start(&mut self, layout: &Arc<RegressorLayout>, samples: usize) {
        assert_eq!(*self.layout, **layout, "block of another model");
        assert!(samples <= self.capacity, "{samples} samples in a block of {}", self.capacity);
        self.samples = samples;
        for output in 0..self.layout.outputs() {
            self.offset[output * self.capacity..][..samples].fill(0.0);
        }
    }

    pub(crate) fn offset_mut(&mut self, output: usize) -> &mut [f64] {
        &mut self.offset[output * self.capacity..][..self.samples]
    }

    pub(crate) fn data_mut(&mut self) -> &mut [f64] {
        &mut self.data
    }

    pub(crate) fn slot_mut(&mut self, slot: usize) -> &mut [f64] {
        &mut self.data[slot * self.capacity..][..self.samples]
    }
}

/// An output of an effort model: one drive or joint.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Name of the joint (with a suffix for the six efforts of a floating joint).
    pub name: String,
    /// Unit of the effort.
    pub unit: &'static str,
}

/// What elements remember of the motion before a block; the default is the start of a record.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History {
    /// Per element; empty at the start.
    pub(crate) states: Vec<Vec<f64>>,
}

impl History {
    /// What every element remembers; empty at the start.
    pub fn states(&self) -> &[Vec<f64>] {
        &self.states
    }

    /// The history of elements that remember this, as [`History::states`] gave it for the same model.
    pub fn of_states(states: Vec<Vec<f64>>) -> Self {
        History { states }
    }
}

/// A model whose effort is linear in most of its parameters:
/// `effort = W(motion; shape) · linear + offset(motion; shape)`.
pub trait EffortModel: Send + Sync {
    /// Outputs in the order of the regressor's rows.
    fn outputs(&self) -> &[Output];
    /// Linear and shape parameters.
    fn parameters(&self) -> &ParameterTable;
    /// Which columns act on which output.
    fn layout(&self) -> &Arc<RegressorLayout>;
    /// Names of the extra channels that a motion block must hold.
    fn channels(&self) -> &[String];
    /// Names of the signals that depend on the motion before; none by default. Where a motion block holds them as channels,
    /// they are used, elsewhere the steady state.
    fn signals(&self) -> &[String] {
        &[]
    }
    /// Forms these signals over a block, signal `k`, sample `s` at `out[k * stride + s]`, and takes `history` to the end of
    /// the block. However a record is cut into blocks, the same bits come out.
    ///
    /// `step_s`: time between samples, s.
    ///
    /// # Panics
    /// If `shape` has the wrong length, a channel is missing or `out` is too short.
    fn remember(
        &self,
        _motion: &MotionBlock<'_>,
        _step_s: f64,
        _shape: &[f64],
        _history: &mut History,
        _stride: usize,
        _out: &mut [f64],
    ) {
    }
    /// Random states, with all that the model reads, for questions about structure that need no log: of closed mechanisms
    /// closed poses. The same seed gives the same numbers.
    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion;
    /// Number of entries of the position vector, number of rates.
    fn dimensions(&self) -> (usize, usize);
    /// For every coordinate without bodies, the last of the rates and of the positions: how far it travels per travel of a
    /// joint, a gear ratio. None by default.
    fn travels(&self) -> &[f64] {
        &[]
    }
    /// Whether nothing drives an output: its effort is known to be zero, and no log has a column for it. False by default.
    fn is_undriven(&self, _output: usize) -> bool {
        false
    }
    /// Speeds whose change of sign spoils rows of an output: combinations `Σ factor · rate` that a sign is taken of.
    /// By default the output's own rate.
    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        vec![vec![(output, 1.0)]]
    }
    /// Fills `out` with the regressor and the offset of all samples of a block.
    ///
    /// # Panics
    /// If the block is larger than `out`, a channel is missing or `shape` has the wrong length.
    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock);

    /// Columns of the regressor that change with the shape parameters: `(output, linear column)`, each once, ascending by
    /// output.
    fn shaped_columns(&self) -> &[(usize, usize)];
    /// Which shape parameter changes which of them: `(index into shaped_columns, shape parameter)`, each once.
    fn shape_dependence(&self) -> &[(usize, usize)];
    /// The columns of [`EffortModel::shaped_columns`], `values[k * stride + s]`, and their derivatives by shape parameters,
    /// `derivatives[d * stride + s]` for the `d`-th pair of [`EffortModel::shape_dependence`]. An empty slice is not wanted.
    /// No rigid-body work is done.
    ///
    /// # Panics
    /// If `shape` has the wrong length, a channel is missing, or a slice that is not empty is too short.
    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    );

    /// Efforts of a block, `W linear + offset`, without forming the regressor: output `o`, sample `s` at
    /// `effort[o * stride + s]`.
    ///
    /// # Panics
    /// If a slice has the wrong length or is too short, or a channel is missing.
    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    );
    /// Adds to `out` the derivatives of `Σ_o Σ_s weights[o * stride + s] · effort_o(s; linear)` with respect to the
    /// motion: the sensitivity to a regressor in the direction of a matrix of rank one, or the gradient of efforts.
    ///
    /// `linear` need not be physical. Gravity and extra channels are held, as is the sign of a velocity without
    /// [`MotionBlock::sign_width`].
    ///
    /// # Panics
    /// Panics as [`EffortModel::efforts`] does; if `out` has other dimensions than motion and model; if a joint floats.
    fn effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    );
    /// Adds to `out` the derivatives of `Σ weights ∘ W` over all entries of the regressor and all samples with respect to
    /// the motion. `weights` has this model's layout; its offsets are not used.
    ///
    /// # Panics
    /// If `weights` is of another model or has another number of samples than `motion`; otherwise as
    /// [`EffortModel::effort_adjoint`].
    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    );
}

impl RandomMotion {
    /// For all that a model of a mechanism reads: motion of its joints and its channels as [`RandomMotion::new`], then its
    /// signals in ±1, then positions in ±π (±1 m), rates in ±2 and accelerations in ±5, each times the ratio of the gear
    /// ([`EffortModel::travels`]), for coordinates without bodies. Deformations of elastic transmissions are thus of the
    /// size of joint positions: far too large for a spring, but of one size in all powers and columns.
    pub fn of(model: &dyn EffortModel, mechanism: &Mechanism, samples: usize, seed: u64) -> Self {
        let channels = model.channels().iter().chain(model.signals());
        Self::new(mechanism, channels, samples, seed).with_coordinates(model, seed)
    }

    /// Returns the motion with that of a model's coordinates without bodies, as [`RandomMotion::of`] says.
    #[must_use]
    pub fn with_coordinates(self, model: &dyn EffortModel, seed: u64) -> Self {
        self.with_travels(model.travels(), seed)
    }
}
