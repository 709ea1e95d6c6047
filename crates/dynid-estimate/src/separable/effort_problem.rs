//! Effort models over plain motion.

use super::places::{OutputPlaces, places};
use super::problem::{RowGroup, SeparableProblem, ShapedColumns};
use super::settings::SeparableError;
use dynid_model::{EffortModel, MotionBlock, RegressorBlock, ShapeParameter};

/// A run of motion with its measured efforts: one time block of a log.
#[derive(Debug, Clone, Copy)]
pub struct EffortBlock<'a> {
    /// Index of the log.
    pub log: usize,
    /// Motion.
    pub motion: MotionBlock<'a>,
    /// Efforts: output `o`, sample `s` at `effort[o * stride + s]` with the stride of the motion, N m or N.
    pub effort: &'a [f64],
}

/// `effort = W(motion; shape) · linear + offset` of any effort model: the regressor's rows as they are, without kernels.
///
/// Groups of rows are the outputs of each log. Linear parameters are the kept columns in the order given.
pub struct EffortProblem<'a> {
    model: &'a dyn EffortModel,
    blocks: Vec<EffortBlock<'a>>,
    places: Vec<OutputPlaces>,
    linear: usize,
    parameters: Vec<ShapeParameter>,
    groups: Vec<RowGroup>,
    /// Per block: first of its log's groups, first row in them.
    rows: Vec<(usize, usize)>,
}

impl std::fmt::Debug for EffortProblem<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("EffortProblem").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

impl<'a> EffortProblem<'a> {
    /// Forms the fixed columns of all blocks.
    ///
    /// `kept`: base columns of the model, ascending. `blocks`: those of a log follow each other in time. Start and bounds
    /// of the shape parameters are those of the model; see [`Self::with_shape`].
    ///
    /// # Errors
    /// [`SeparableError::NoRows`] without a sample; [`SeparableError::Size`] if a block has too few efforts.
    ///
    /// # Panics
    /// If a channel that the model needs is missing from a motion.
    pub fn new(
        model: &'a dyn EffortModel,
        kept: &[usize],
        blocks: &[EffortBlock<'a>],
    ) -> Result<Self, SeparableError> {
        let places = places(model, kept);
        let outputs = places.len();
        let samples = blocks.iter().map(|b| b.motion.samples).max().unwrap_or(0);
        if samples == 0 {
            return Err(SeparableError::NoRows);
        }
        let shape = model.parameters().shape_start();
        let mut logs: Vec<usize> = blocks.iter().map(|b| b.log).collect();
        logs.sort_unstable();
        logs.dedup();
        let mut groups: Vec<RowGroup> =
            logs.iter().flat_map(|log| places.iter().enumerate().map(|(o, p)| p.group(*log, o, 0))).collect();
        let mut columns: Vec<Vec<Vec<f64>>> =
            groups.iter().map(|g| vec![Vec::new(); g.fixed.len()]).collect();
        let mut regressor = RegressorBlock::new(model.layout().clone(), samples);
        let mut rows = Vec::with_capacity(blocks.len());
        for block in blocks {
            let first = logs.partition_point(|log| *log < block.log) * outputs;
            let (count, stride) = (block.motion.samples, block.motion.stride);
            let expected = if count == 0 { 0 } else { (outputs - 1) * stride + count };
            if block.effort.len() < expected {
                let found = block.effort.len();
                return Err(SeparableError::Size {
                    group: first,
                    what: "efforts of a block",
                    expected,
                    found,
                });
            }
            rows.push((first, groups[first].rows()));
            model.regressor(&block.motion, &shape, &mut regressor);
            for (output, places) in places.iter().enumerate() {
                let group = &mut groups[first + output];
                let measured = &block.effort[output * stride..][..count];
                group
                    .effort
                    .extend(measured.iter().zip(regressor.offset(output)).map(|(y, known)| y - known));
                group.block_rows.push(count);
                for ((acting, _), column) in places.fixed.iter().zip(&mut columns[first + output]) {
                    column.extend_from_slice(regressor.column(output, *acting));
                }
            }
        }
        for (group, columns) in groups.iter_mut().zip(columns) {
            group.fixed_values = columns.concat();
        }
        Ok(EffortProblem {
            model,
            blocks: blocks.to_vec(),
            places,
            linear: kept.len(),
            parameters: model.parameters().shape.clone(),
            groups,
            rows,
        })
    }

    /// Returns the problem with other starts and bounds of the shape parameters.
    ///
    /// # Panics
    /// Unless there is one entry per shape parameter of the model.
    #[must_use]
    pub fn with_shape(mut self, parameters: Vec<ShapeParameter>) -> Self {
        assert_eq!(parameters.len(), self.parameters.len(), "one entry per shape parameter");
        self.parameters = parameters;
        self
    }
}

impl SeparableProblem for EffortProblem<'_> {
    fn linear(&self) -> usize {
        self.linear
    }

    fn shape(&self) -> &[ShapeParameter] {
        &self.parameters
    }

    fn groups(&self) -> &[RowGroup] {
        &self.groups
    }

    fn shaped(&self, shape: &[f64], out: &mut [ShapedColumns]) {
        let (shaped, dependent) = (self.model.shaped_columns().len(), self.model.shape_dependence().len());
        let (mut values, mut derivatives) = (Vec::new(), Vec::new());
        for (block, (first, row)) in self.blocks.iter().zip(&self.rows) {
            let n = block.motion.samples;
            values.resize(shaped * n, 0.0);
            derivatives.resize(dependent * n, 0.0);
            self.model.shaped(&block.motion, shape, n, &mut values, &mut derivatives);
            for (output, places) in self.places.iter().enumerate() {
                let out = &mut out[first + output];
                for (k, (index, _)) in places.shaped.iter().enumerate() {
                    out.value_mut(k)[*row..row + n].copy_from_slice(&values[index * n..][..n]);
                }
                for (d, (index, ..)) in places.dependence.iter().enumerate() {
                    out.derivative_mut(d)[*row..row + n].copy_from_slice(&derivatives[index * n..][..n]);
                }
            }
        }
    }
}
