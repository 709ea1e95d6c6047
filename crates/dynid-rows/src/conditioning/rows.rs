//! Rows of the regression: columns and efforts through the compact kernels.

use std::ops::Range;

use dynid_model::element::SlipSpring;
use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::{Channel, Kernel, SignalError};
use rayon::prelude::*;

use super::friction_shape::{FrictionShape, ShapeKind};
use super::masks::Masks;
use super::states::States;
use super::windows::add_windows;
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

    /// Kernels alone, for a sample rate.
    pub(crate) fn of_rate(scales_hz: &[f64], rate_hz: f64) -> Result<Self, SignalError> {
        let kernels = scales_hz.iter().map(|f| Kernel::new(*f, rate_hz)).collect::<Result<Vec<_>, _>>()?;
        Ok(Kernels { kernels, outer: 0, inner: 0 })
    }

    /// Half width of the widest kernel, and the least distance of samples at which rows of all kernels are centred.
    pub(crate) fn reach_and_grid(&self) -> (usize, usize) {
        let reach = self.kernels.iter().map(Kernel::half_width).max().unwrap_or(0);
        let grid = self.kernels.iter().map(Kernel::spacing).fold(1, least_common_multiple);
        (reach, grid)
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

fn least_common_multiple(a: usize, b: usize) -> usize {
    let (mut x, mut y) = (a, b);
    while y != 0 {
        (x, y) = (y, x % y);
    }
    a / x * b
}

/// A batch of rows of one output at one scale.
pub(crate) struct RowBatch<'a> {
    pub(crate) scale: usize,
    /// Centres of the rows, ascending.
    pub(crate) centres: &'a [usize],
    /// Rungs at which each row is used.
    pub(crate) rungs: &'a [u8],
    /// Kept regressor columns, then columns of friction shapes, column-major; the model's known offset is the last column. Where the
    /// pass has instruments, their kept columns come before all.
    pub(crate) columns: &'a [f64],
    /// Distance between the starts of two columns, at least the number of rows.
    pub(crate) stride: usize,
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

/// Samples of the log that one thread takes at a time, at least; twice the reach of the kernels otherwise.
const STRETCH: usize = 8192;
/// Samples whose regressor is held at a time: with some 300 entries per sample it stays in the second-level cache.
const PIECE: usize = 256;
/// Stretches worked on at a time per thread: more even out the time that they take.
const PER_THREAD: usize = 2;

/// Rows of one output at one scale while their columns are summed.
#[derive(Default)]
struct Rows {
    centres: Vec<usize>,
    rungs: Vec<u8>,
    /// Column-major.
    columns: Vec<f64>,
}

/// Signals that depend on the motion before, of the states and of the instruments.
struct Remembered {
    own: Vec<Channel>,
    instruments: Vec<Channel>,
    /// Per output, friction shape and stretch: springs at its start.
    springs: Vec<Vec<Vec<SlipSpring>>>,
}

impl Pass<'_> {
    /// Runs through the log once and hands every row to the consumer of its output, in time order for each scale.
    ///
    /// Threads take stretches of the log. Windows that reach over the end of a stretch are summed in two parts, and no regressor is
    /// formed twice.
    pub(crate) fn run<C: RowConsumer>(&self, consumers: &mut [C]) -> Result<(), RowsError> {
        let samples = self.states.samples;
        let stretch = STRETCH.max(2 * self.kernels.kernels[0].half_width());
        let stretches: Vec<Range<usize>> =
            (0..samples).step_by(stretch).map(|start| start..(start + stretch).min(samples)).collect();
        let remembered = Remembered {
            own: self.states.remembered(self.model, self.shape, &self.log.channels),
            instruments: self
                .instruments
                .map(|states| states.remembered(self.model, self.shape, &self.log.channels))
                .unwrap_or_default(),
            springs: self.springs(&stretches),
        };
        // Per output and scale: rows that the next stretch has a part of.
        let mut open: Vec<Vec<Rows>> = consumers.iter().map(|_| self.no_rows()).collect();
        let mut formed = Vec::new();
        // While rows are handed over, the next ones are formed.
        let numbered: Vec<(usize, Range<usize>)> = stretches.into_iter().enumerate().collect();
        let groups = numbered.chunks(PER_THREAD * rayon::current_num_threads());
        for group in groups.chain([&[][..]]) {
            let (next, handed) = rayon::join(
                || {
                    let rows =
                        |(place, part): &(usize, Range<usize>)| self.rows(*place, part.clone(), &remembered);
                    group.par_iter().map(rows).collect::<Vec<_>>()
                },
                || self.hand_over(std::mem::take(&mut formed), &mut open, consumers),
            );
            handed?;
            formed = group.iter().map(|(_, part)| part.end).zip(next).collect();
        }
        Ok(())
    }

    fn no_rows(&self) -> Vec<Rows> {
        self.kernels.kernels.iter().map(|_| Rows::default()).collect()
    }

    /// Per output, friction shape and stretch: springs at its start.
    fn springs(&self, stretches: &[Range<usize>]) -> Vec<Vec<Vec<SlipSpring>>> {
        let of_output = |(output, shapes): (usize, &Vec<FrictionShape>)| -> Vec<Vec<SlipSpring>> {
            let positions = self.states.position(output);
            let is_spring = |shape: &FrictionShape| shape.kind == ShapeKind::MaxwellSlip;
            let speeds = match shapes.iter().any(is_spring) {
                true => self.states.velocity(output),
                false => Vec::new(),
            };
            let of_shape = |shape: &FrictionShape| -> Vec<SlipSpring> {
                let mut spring = SlipSpring::default();
                if let (true, Some(speed)) = (is_spring(shape), speeds.first()) {
                    spring = SlipSpring::at(positions[0], *speed);
                }
                let at_start = |stretch: &Range<usize>| {
                    let held = spring;
                    if is_spring(shape) {
                        let part = stretch.clone();
                        shape.column(&positions[part.clone()], &speeds[part], &[], &mut spring);
                    }
                    held
                };
                stretches.iter().map(at_start).collect()
            };
            shapes.iter().map(of_shape).collect()
        };
        self.shapes.par_iter().enumerate().map(of_output).collect()
    }

    /// Per output and scale: rows whose windows reach into a stretch of the log, with what it holds of them.
    fn rows(&self, place: usize, stretch: Range<usize>, remembered: &Remembered) -> Vec<Vec<Rows>> {
        let layout = self.model.layout();
        let mut regressor = RegressorBlock::new(layout.clone(), PIECE.min(stretch.len()));
        let mut instruments = self.instruments.map(|_| regressor.clone());
        let outputs = 0..layout.outputs();
        let mut rows: Vec<Vec<Rows>> =
            outputs.clone().map(|output| self.empty_rows(output, &stretch)).collect();
        let mut springs: Vec<Vec<SlipSpring>> =
            remembered.springs.iter().map(|held| held.iter().map(|held| held[place]).collect()).collect();
        for start in stretch.clone().step_by(PIECE) {
            let piece = start..(start + PIECE).min(stretch.end);
            self.fill(self.states, piece.clone(), &remembered.own, &mut regressor);
            if let (Some(states), Some(block)) = (self.instruments, &mut instruments) {
                self.fill(states, piece.clone(), &remembered.instruments, block);
            }
            let blocks = (&regressor, instruments.as_ref());
            for ((output, rows), springs) in outputs.clone().zip(&mut rows).zip(&mut springs) {
                self.add_columns(output, start, blocks, springs, rows);
            }
        }
        rows
    }

    fn fill(&self, states: &States, range: Range<usize>, remembered: &[Channel], block: &mut RegressorBlock) {
        states.with_block(range, &self.log.channels, remembered, |motion| {
            self.model.regressor(motion, self.shape, block);
        });
    }

    /// Rows of an output whose windows reach into a stretch of the log, their columns still empty.
    fn empty_rows(&self, output: usize, stretch: &Range<usize>) -> Vec<Rows> {
        let own = self.columns.local[output].len() * (1 + usize::from(self.instruments.is_some()));
        let width = own + self.shapes[output].len() + 1;
        let of_scale = |(scale, kernel): (usize, &Kernel)| {
            let mut rows = Rows::default();
            let (spacing, half_width) = (kernel.spacing(), kernel.half_width());
            let from = stretch.start.saturating_sub(half_width).div_ceil(spacing) * spacing;
            let end = (stretch.end + half_width).min(self.states.samples);
            for centre in (from..end).step_by(spacing) {
                let used = self.kernels.used(&self.masks[output], scale, centre) & self.wanted[output];
                if used != 0 {
                    rows.centres.push(centre);
                    rows.rungs.push(used);
                }
            }
            rows.columns = vec![0.0; width * rows.centres.len()];
            rows
        };
        self.kernels.kernels.iter().enumerate().map(of_scale).collect()
    }

    /// Adds what a piece of the regressor, from sample `first` on, holds of the rows' windows.
    fn add_columns(
        &self,
        output: usize,
        first: usize,
        (regressor, instruments): (&RegressorBlock, Option<&RegressorBlock>),
        springs: &mut [SlipSpring],
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
        let positions = &self.states.position(output)[first..first + regressor.samples()];
        let shapes = self.shapes[output].iter().zip(springs);
        let shaped: Vec<Vec<f64>> =
            shapes.map(|(s, spring)| s.column(positions, &speed, &loads, spring)).collect();
        let local = &self.columns.local[output];
        let columns: Vec<&[f64]> = instruments
            .iter()
            .flat_map(|block| local.iter().map(|k| block.column(output, *k)))
            .chain(local.iter().map(|k| regressor.column(output, *k)))
            .chain(shaped.iter().map(Vec::as_slice))
            .chain([regressor.offset(output)])
            .collect();
        for (rows, kernel) in rows.iter_mut().zip(&self.kernels.kernels) {
            add_windows(kernel, first, &rows.centres, &columns, &mut rows.columns);
        }
    }

    /// Hands over the rows that are complete. `formed`: ends of stretches with their rows; `open`: rows that the stretch before the
    /// first one left.
    fn hand_over<C: RowConsumer>(
        &self,
        formed: Vec<(usize, Vec<Vec<Rows>>)>,
        open: &mut [Vec<Rows>],
        consumers: &mut [C],
    ) -> Result<(), RowsError> {
        let mut of_outputs: Vec<Vec<(usize, Vec<Rows>)>> = consumers.iter().map(|_| Vec::new()).collect();
        for (end, outputs) in formed {
            for (all, rows) in of_outputs.iter_mut().zip(outputs) {
                all.push((end, rows));
            }
        }
        let outcomes: Vec<Result<(), RowsError>> = consumers
            .par_iter_mut()
            .zip(open)
            .zip(of_outputs)
            .enumerate()
            .map(|(output, ((consumer, open), stretches))| {
                for (end, mut rows) in stretches {
                    for (scale, (rows, open)) in rows.iter_mut().zip(&mut *open).enumerate() {
                        rows.add_first(open);
                        self.hand_over_complete(output, scale, end, rows, consumer)?;
                        *open = rows.last(self.complete(scale, end, &rows.centres));
                    }
                }
                Ok(())
            })
            .collect();
        outcomes.into_iter().collect()
    }

    fn hand_over_complete<C: RowConsumer>(
        &self,
        output: usize,
        scale: usize,
        end: usize,
        rows: &Rows,
        consumer: &mut C,
    ) -> Result<(), RowsError> {
        let count = self.complete(scale, end, &rows.centres);
        if count == 0 {
            return Ok(());
        }
        consumer.take(
            output,
            &RowBatch {
                scale,
                centres: &rows.centres[..count],
                rungs: &rows.rungs[..count],
                columns: &rows.columns,
                stride: rows.centres.len(),
                half_width: self.kernels.kernels[scale].half_width(),
            },
        )
    }

    /// Number of rows, of those with the centres given, whose windows end before a sample.
    fn complete(&self, scale: usize, end: usize, centres: &[usize]) -> usize {
        let half_width = self.kernels.kernels[scale].half_width();
        centres.partition_point(|centre| centre + half_width < end)
    }
}

impl Rows {
    /// Adds to the first rows what the stretch before holds of them.
    fn add_first(&mut self, before: &Rows) {
        let (count, own) = (before.centres.len(), self.centres.len());
        assert_eq!(self.centres[..count], before.centres, "rows that two stretches share");
        if count > 0 {
            let pairs = self.columns.chunks_exact_mut(own).zip(before.columns.chunks_exact(count));
            pairs.for_each(|(to, from)| to.iter_mut().zip(from).for_each(|(to, from)| *to += from));
        }
    }

    /// Copy of all rows but the first ones.
    fn last(&self, from: usize) -> Rows {
        let columns = self.columns.chunks_exact(self.centres.len().max(1));
        Rows {
            centres: self.centres[from..].to_vec(),
            rungs: self.rungs[from..].to_vec(),
            columns: columns.flat_map(|column| &column[from..]).copied().collect(),
        }
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
