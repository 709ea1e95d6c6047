//! Rows of the regression: columns and efforts through the compact kernels.

use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::{Channel, Kernel, SignalError};
use rayon::prelude::*;

use super::friction_shape::{FrictionShape, ShapeKind};
use super::states::{Masks, States};
use super::{ConditioningSettings, PreparedLog};
use dynid_factor::rows::RowsError;

/// Which regressor columns a pass keeps, per output.
#[derive(Debug, Clone)]
pub(crate) struct KeptColumns {
    /// Per output: positions within the output's acting columns.
    pub(crate) local: Vec<Vec<usize>>,
    /// Per output: positions within the base columns.
    pub(crate) global: Vec<Vec<usize>>,
    /// Number of base columns.
    pub(crate) total: usize,
}

impl KeptColumns {
    pub(crate) fn new(model: &dyn EffortModel, kept: &[usize]) -> Self {
        let layout = model.layout();
        let (mut local, mut global) = (Vec::new(), Vec::new());
        for output in 0..layout.outputs() {
            let (mut l, mut g) = (Vec::new(), Vec::new());
            for (k, column) in layout.columns(output).iter().enumerate() {
                if let Ok(position) = kept.binary_search(column) {
                    l.push(k);
                    g.push(position);
                }
            }
            local.push(l);
            global.push(g);
        }
        KeptColumns { local, global, total: kept.len() }
    }
}

/// Kernels of one pass over one log, widest first.
#[derive(Debug, Clone)]
pub(crate) struct Kernels {
    pub(crate) kernels: Vec<Kernel>,
    /// Samples beyond the kernel that the state filter reaches: to edges and gaps, to reversals.
    outer: usize,
    inner: usize,
}

impl Kernels {
    pub(crate) fn new(scales_hz: &[f64], states: &States, extra_reach: usize) -> Result<Self, SignalError> {
        let kernels =
            scales_hz.iter().map(|f| Kernel::new(*f, states.rate_hz)).collect::<Result<Vec<_>, _>>()?;
        let reach = |parts: f64| (parts * states.rate_hz / states.cutoff_hz).ceil() as usize;
        Ok(Kernels { kernels, outer: reach(1.0) + extra_reach, inner: reach(0.5) })
    }

    /// Rungs at which the row of a scale is used at a centre: usable there, and no wider kernel is.
    fn used(&self, masks: &Masks, scale: usize, centre: usize) -> u8 {
        let bits = |k: usize| masks.usable(centre, self.kernels[k].half_width(), self.outer, self.inner);
        let own = bits(scale);
        (0..scale).fold(own, |b, wider| if b == 0 { 0 } else { b & !bits(wider) })
    }

    /// Share of samples at which some kernel is usable, per rung.
    pub(crate) fn coverage(&self, masks: &Masks, samples: usize) -> Vec<f64> {
        let mut counts = vec![0usize; masks.rungs()];
        let step = (samples / 4096).max(1);
        let mut probes = 0usize;
        for centre in (0..samples).step_by(step) {
            probes += 1;
            let last = self.kernels.len() - 1;
            let bits = masks.usable(centre, self.kernels[last].half_width(), self.outer, self.inner);
            for (rung, count) in counts.iter_mut().enumerate() {
                *count += usize::from(bits >> rung & 1 == 1);
            }
        }
        counts.iter().map(|c| *c as f64 / probes.max(1) as f64).collect()
    }
}

/// A batch of rows of one output at one scale.
pub(crate) struct RowBatch<'a> {
    pub(crate) scale: usize,
    /// Centres of the rows, ascending.
    pub(crate) centres: &'a [usize],
    /// Rungs at which each row is used.
    pub(crate) rungs: &'a [u8],
    /// Kept regressor columns, then columns of friction shapes, column-major with stride `centres.len()`; the model's known
    /// offset is the last column. Where the pass has instruments, their kept columns come before all.
    pub(crate) columns: &'a [f64],
    /// Half width of the kernel.
    pub(crate) half_width: usize,
}

/// Takes the rows of one output; one per output, so that outputs run in parallel with the same result.
pub(crate) trait RowConsumer: Send {
    fn take(&mut self, output: usize, batch: &RowBatch<'_>) -> Result<(), RowsError>;
}

/// What a pass runs over.
pub(crate) struct Pass<'a> {
    pub(crate) model: &'a dyn EffortModel,
    pub(crate) shape: &'a [f64],
    pub(crate) columns: &'a KeptColumns,
    pub(crate) log: &'a PreparedLog,
    pub(crate) states: &'a States,
    /// States of another motion whose kept regressor columns pass through the same kernels at the same centres.
    pub(crate) instruments: Option<&'a States>,
    pub(crate) masks: &'a [Masks],
    pub(crate) kernels: &'a Kernels,
    /// Only rows used at one of these rungs are computed, per output.
    pub(crate) wanted: &'a [u8],
    /// Per output: friction shapes of its speed that get columns of their own.
    pub(crate) shapes: &'a [Vec<FrictionShape>],
    /// Linear parameters whose effort is the load of [`ShapeKind::Load`]; empty if no shape asks for it.
    pub(crate) load: &'a [f64],
}

/// Samples whose rows are formed at a time, at least; a multiple of the kernels' reach otherwise.
const BLOCK: usize = 2048;
/// Entries of the regressor that are held at a time, 16 MB of them: the windows of wide kernels over fast logs are longer.
const ENTRIES: usize = 1 << 21;

/// Rows of one output at one scale while their columns are summed.
struct Rows {
    scale: usize,
    centres: Vec<usize>,
    rungs: Vec<u8>,
    columns: Vec<f64>,
}

impl Pass<'_> {
    /// Runs through the log once and hands every row to the consumer of its output, in time order for each scale.
    pub(crate) fn run<C: RowConsumer>(&self, consumers: &mut [C]) -> Result<(), RowsError> {
        let samples = self.states.samples;
        let reach = self.kernels.kernels[0].half_width();
        let block = BLOCK.max(6 * reach);
        let layout = self.model.layout();
        let slots = (0..layout.outputs()).map(|output| layout.columns(output).len() + 1).sum::<usize>();
        let piece = (block + 2 * reach).min((ENTRIES / slots).max(BLOCK)).min(samples);
        let mut regressor = RegressorBlock::new(layout.clone(), piece);
        let mut instruments = self.instruments.map(|_| regressor.clone());
        let remembered = self.remembered(self.states);
        let simulated = self.instruments.map(|states| self.remembered(states));
        let mut start = 0;
        while start < samples {
            let end = (start + block).min(samples);
            let mut rows: Vec<Vec<Rows>> =
                (0..consumers.len()).into_par_iter().map(|output| self.rows(output, start..end)).collect();
            let mut first = start.saturating_sub(reach);
            let last = (end + reach).min(samples);
            while first < last {
                let range = first..(first + piece).min(last);
                self.fill(self.states, range.clone(), &remembered, &mut regressor);
                if let (Some(states), Some(signals), Some(block)) =
                    (self.instruments, &simulated, &mut instruments)
                {
                    self.fill(states, range.clone(), signals, block);
                }
                let blocks = (&regressor, instruments.as_ref());
                rows.par_iter_mut().enumerate().for_each(|(output, rows)| {
                    self.add_columns(output, range.start, blocks, rows);
                });
                first = range.end;
            }
            consumers
                .par_iter_mut()
                .zip(rows)
                .enumerate()
                .map(|(output, (consumer, rows))| self.hand_over(output, &rows, consumer))
                .collect::<Result<Vec<()>, _>>()?;
            start = end;
        }
        Ok(())
    }

    fn remembered(&self, states: &States) -> Vec<Channel> {
        states.remembered(self.model, self.shape, &self.log.channels)
    }

    fn fill(
        &self,
        states: &States,
        range: std::ops::Range<usize>,
        remembered: &[Channel],
        block: &mut RegressorBlock,
    ) {
        states.with_block(range, &self.log.channels, remembered, |motion| {
            self.model.regressor(motion, self.shape, block);
        });
    }

    /// Rows of an output whose centres lie in a range, their columns still empty.
    fn rows(&self, output: usize, centres_in: std::ops::Range<usize>) -> Vec<Rows> {
        let own = self.columns.local[output].len() * (1 + usize::from(self.instruments.is_some()));
        let width = own + self.shapes[output].len() + 1;
        let mut out = Vec::new();
        for (scale, kernel) in self.kernels.kernels.iter().enumerate() {
            let (mut centres, mut rungs) = (Vec::new(), Vec::new());
            let spacing = kernel.spacing();
            let from = centres_in.start.div_ceil(spacing) * spacing;
            for centre in (from..centres_in.end).step_by(spacing) {
                let used = self.kernels.used(&self.masks[output], scale, centre) & self.wanted[output];
                if used != 0 {
                    centres.push(centre);
                    rungs.push(used);
                }
            }
            if !centres.is_empty() {
                let columns = vec![0.0; width * centres.len()];
                out.push(Rows { scale, centres, rungs, columns });
            }
        }
        out
    }

    /// Adds what a piece of the regressor, from sample `first` on, holds of the rows' windows.
    fn add_columns(
        &self,
        output: usize,
        first: usize,
        (regressor, instruments): (&RegressorBlock, Option<&RegressorBlock>),
        rows: &mut [Rows],
    ) {
        let speed = match self.shapes[output].is_empty() {
            true => Vec::new(),
            false => self.states.velocity_in(output, first..first + regressor.samples()),
        };
        let loads = match self.shapes[output].iter().any(|s| s.kind == ShapeKind::Load) {
            true => regressor.effort(output, self.load),
            false => Vec::new(),
        };
        let shaped: Vec<Vec<f64>> = self.shapes[output].iter().map(|s| s.column(&speed, &loads)).collect();
        let local = &self.columns.local[output];
        for Rows { scale, centres, columns, .. } in rows {
            let sources = instruments
                .iter()
                .flat_map(|block| local.iter().map(|k| block.column(output, *k)))
                .chain(local.iter().map(|k| regressor.column(output, *k)))
                .chain(shaped.iter().map(Vec::as_slice))
                .chain([regressor.offset(output)]);
            for (source, out) in sources.zip(columns.chunks_exact_mut(centres.len())) {
                self.kernels.kernels[*scale].add_block(source, first, centres, out);
            }
        }
    }

    fn hand_over<C: RowConsumer>(
        &self,
        output: usize,
        rows: &[Rows],
        consumer: &mut C,
    ) -> Result<(), RowsError> {
        for Rows { scale, centres, rungs, columns } in rows {
            let half_width = self.kernels.kernels[*scale].half_width();
            consumer.take(output, &RowBatch { scale: *scale, centres, rungs, columns, half_width })?;
        }
        Ok(())
    }
}

/// All masks of a log, one per output.
pub(crate) fn masks(
    log: &PreparedLog,
    states: &States,
    model: &dyn EffortModel,
    settings: &ConditioningSettings,
) -> Vec<Masks> {
    (0..model.outputs().len())
        .into_par_iter()
        .map(|output| Masks::new(log, states, model, output, settings))
        .collect()
}
