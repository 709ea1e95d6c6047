//! Rows of the final fit, formed from the logs on every pass.

use dynid_model::{EffortModel, History};
use dynid_motion::{Kernel, shift};
use rayon::prelude::*;

use super::masks::Masks;
use super::rows::{KeptColumns, Kernels, Pass, RowBatch, RowConsumer, masks};
use super::states::{Recall, States};
use super::windows::means;
use super::{Conditioning, ConditioningError, ConditioningSettings, PreparedLog};
use dynid_estimate::instruments::paired_columns;
use dynid_factor::rows::{GroupShape, RowSource, RowVisitor, Rows, RowsError};

/// Most time blocks per log ...
const MAX_BLOCKS: usize = 64;
/// ... and of all logs together, but for one per log: every block takes a factor per output and kernel.
const MOST_BLOCKS: usize = 256;

/// Most time blocks of each of so many logs, unless [`ConditioningSettings::most_blocks`] says otherwise.
pub fn most_blocks(logs: usize) -> usize {
    (MOST_BLOCKS / logs.max(1)).clamp(1, MAX_BLOCKS)
}

/// Length, samples, and number of the time blocks of one of so many logs; the last one takes the rest. Where a motion repeats its period is a
/// whole number of blocks, two at least.
pub fn time_blocks(
    log: &PreparedLog,
    kernel_hz: f64,
    logs: usize,
    settings: &ConditioningSettings,
) -> (usize, usize) {
    let most = settings.most_blocks.unwrap_or_else(|| most_blocks(logs));
    let least = least_block_samples(kernel_hz, log.rate_hz, settings);
    let length = least.max(log.samples().div_ceil(most));
    let of_period = log.repeats_after.map(|period| {
        let parts = (period / length as f64).floor().max(2.0);
        ((period / parts).round() as usize).max(1)
    });
    // Where very many periods would have very many blocks, they are blocks of several periods.
    let length = of_period.filter(|part| log.samples() / part <= MOST_BLOCKS).unwrap_or(length);
    (length, (log.samples() / length).max(1))
}

/// Least length of a time block, samples: the stated one, and five times `1 / kernel_hz`.
pub fn least_block_samples(kernel_hz: f64, rate_hz: f64, settings: &ConditioningSettings) -> usize {
    let longest = (settings.block_s * rate_hz).max(5.0 * rate_hz / kernel_hz);
    (longest.ceil() as usize).max(1)
}

/// Rows of prepared logs with the choices made, one group per log, output and kernel scale, in that order.
///
/// States of all logs are held; regressors and kernels are computed again on every pass. Where the rows fit in memory,
/// [`dynid_factor::rows::MemoryRows::collect`] makes further passes cheap.
pub struct LogRows<'a> {
    pub(super) model: &'a dyn EffortModel,
    shape: &'a [f64],
    columns: KeptColumns,
    /// Per output: the rung of its mask, as a bit.
    wanted: Vec<u8>,
    pub(super) logs: Vec<ConditionedLog<'a>>,
    groups: Vec<GroupShape>,
}

impl std::fmt::Debug for LogRows<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LogRows").field("groups", &self.groups).finish_non_exhaustive()
    }
}

pub(super) struct ConditionedLog<'a> {
    pub(super) log: &'a PreparedLog,
    pub(super) states: States,
    /// States of a simulated motion, where rows are paired with instruments.
    instruments: Option<States>,
    masks: Vec<Masks>,
    pub(super) kernels: Kernels,
    /// Per output: effort led by the delay.
    efforts: Vec<Vec<f64>>,
    /// Per output: its derivative, where rows have a column for the rest of the delay.
    slopes: Option<Vec<Vec<f64>>>,
    block_length: usize,
    blocks: usize,
}

impl<'a> ConditionedLog<'a> {
    fn new(
        model: &dyn EffortModel,
        log: &'a PreparedLog,
        state_hz: f64,
        choices: &Conditioning,
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        let mut states = States::new(log, state_hz, settings)?;
        let masks = masks(log, &states, model, settings);
        let reach = choices.delay.samples.abs().ceil() as usize + 3;
        let kernels = Kernels::new(&choices.scales_hz, &states, reach)?;
        // Each unshifted effort goes as soon as it was read.
        let efforts = std::mem::take(&mut states.effort)
            .into_par_iter()
            .map(|e| Ok(shift::shift(&e, -choices.delay.samples)?.values))
            .collect::<Result<Vec<Vec<f64>>, ConditioningError>>()?;
        let (block_length, blocks) = time_blocks(log, choices.kernel_hz, choices.state_hz.len(), settings);
        Ok(ConditionedLog {
            log,
            states,
            instruments: None,
            masks,
            kernels,
            efforts,
            slopes: None,
            block_length,
            blocks,
        })
    }
}

impl<'a> LogRows<'a> {
    /// Rows of all logs.
    ///
    /// `kept`: base columns of the model, ascending; `choices`: found by [`super::condition`] for these logs.
    ///
    /// # Errors
    /// [`ConditioningError`] if a signal cannot be filtered.
    pub fn new(
        model: &'a dyn EffortModel,
        shape: &'a [f64],
        kept: &[usize],
        logs: &'a [PreparedLog],
        choices: &Conditioning,
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        Self::of(model, shape, kept, logs.iter().enumerate(), choices, settings)
    }

    /// Rows of logs paired with instruments, `[Z | W | y]`: `Z` is the regressor of another motion on the logs' grids, through the
    /// state filter, kernels, masks and centres of the measured one (see [`dynid_estimate::instruments`]).
    ///
    /// `motions`: one per log, per output its positions at the log's samples, rad or m. Columns of the groups are those of
    /// [`dynid_estimate::instruments::paired_columns`] for all base columns; `settings` as in [`LogRows::new`].
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for a position that is not finite.
    ///
    /// # Panics
    /// Unless there is one motion per log with a position per output and sample, or if the rows are paired already.
    pub fn with_instruments(
        mut self,
        motions: &[Vec<Vec<f64>>],
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        assert_eq!(motions.len(), self.logs.len(), "one motion per log");
        for (log, motion) in self.logs.iter_mut().zip(motions) {
            assert!(log.instruments.is_none(), "rows are paired once");
            log.instruments = Some(log.states.along(motion, settings)?);
        }
        for group in &mut self.groups {
            group.columns = paired_columns(&group.columns, self.columns.total);
        }
        Ok(self)
    }

    /// Rows with a column more per output, behind all base columns: the derivative of its effort, whose parameter is the rest of the delay of the
    /// motion behind it, s.
    ///
    /// `y(t - δ) = W x` with the effort `y` led by the delay of the choices gives `y = W x + δ dy/dt`, for `δ` well below the period of what
    /// passes the kernel. The derivative goes through the kernel like the effort; its noise is uncorrelated with that of the effort, and what it
    /// adds to the column is what the kernel lets pass.
    ///
    /// # Errors
    /// [`ConditioningError::Signal`] for an effort that is not finite.
    ///
    /// # Panics
    /// If the rows are paired with instruments.
    pub fn with_delay_columns(mut self) -> Result<Self, ConditioningError> {
        for log in &mut self.logs {
            assert!(log.instruments.is_none(), "rows with a measured motion alone");
            let rate = log.log.rate_hz;
            let per_second = |effort: &Vec<f64>| -> Result<Vec<f64>, ConditioningError> {
                let per_sample = shift::shift_derivative(effort, 0.0)?.values;
                Ok(per_sample.into_iter().map(|slope| rate * slope).collect())
            };
            log.slopes = Some(log.efforts.iter().map(per_second).collect::<Result<_, _>>()?);
        }
        for group in &mut self.groups {
            group.columns.push(self.columns.total + group.output);
        }
        Ok(self)
    }

    /// Rows of logs each of which goes on from what an earlier record left, where elements remember the motion.
    ///
    /// # Panics
    /// Unless there is one recall per log.
    #[must_use]
    pub fn recalling(mut self, recalls: Vec<Recall>) -> Self {
        assert_eq!(recalls.len(), self.logs.len(), "one recall per log");
        self.logs.iter_mut().zip(recalls).for_each(|(log, recall)| log.states.recall = recall);
        self
    }

    /// What elements remember of a log before a sample.
    pub fn history_at(&self, log: usize, sample: usize) -> History {
        let ConditionedLog { log, states, .. } = &self.logs[log];
        states.history_at(sample, self.model, self.shape, &log.channels)
    }

    pub(super) fn of(
        model: &'a dyn EffortModel,
        shape: &'a [f64],
        kept: &[usize],
        logs: impl Iterator<Item = (usize, &'a PreparedLog)>,
        choices: &Conditioning,
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        let settings = &super::with_given_mask(settings);
        let columns = KeptColumns::new(model, kept);
        let (mut conditioned, mut groups) = (Vec::new(), Vec::new());
        for (index, log) in logs {
            let one = ConditionedLog::new(model, log, choices.state_hz[index], choices, settings)?;
            for (output, positions) in columns.global.iter().enumerate() {
                groups.extend((0..one.kernels.kernels.len()).map(|scale| GroupShape {
                    log: index,
                    output,
                    scale,
                    columns: positions.clone(),
                    blocks: one.blocks,
                }));
            }
            conditioned.push(one);
        }
        let wanted = choices.rung.iter().map(|r| 1 << r).collect();
        Ok(LogRows { model, shape, columns, wanted, logs: conditioned, groups })
    }
}

impl RowSource for LogRows<'_> {
    fn groups(&self) -> &[GroupShape] {
        &self.groups
    }

    fn visit(&self, visitors: &mut [&mut dyn RowVisitor]) -> Result<(), RowsError> {
        assert_eq!(visitors.len(), self.groups.len(), "one visitor per group");
        let mut rest = visitors;
        let mut first_group = 0;
        for log in &self.logs {
            let scales = log.kernels.kernels.len();
            let (own, others) = rest.split_at_mut(scales * log.efforts.len());
            let mut consumers: Vec<OutputRows<'_, '_>> = own
                .chunks_mut(scales)
                .enumerate()
                .map(|(output, visitors)| OutputRows {
                    visitors,
                    first_group: first_group + output * scales,
                    effort: &log.efforts[output],
                    slope: log.slopes.as_ref().map(|slopes| &slopes[output][..]),
                    with_slope: Vec::new(),
                    kernels: &log.kernels.kernels,
                    columns: self.columns.local[output].len() * (1 + usize::from(log.instruments.is_some())),
                    block_length: log.block_length,
                    blocks: log.blocks,
                    net_effort: Vec::new(),
                })
                .collect();
            Pass {
                model: self.model,
                shape: self.shape,
                columns: &self.columns,
                log: log.log,
                states: &log.states,
                instruments: log.instruments.as_ref(),
                masks: &log.masks,
                kernels: &log.kernels,
                wanted: &self.wanted,
                shapes: &vec![Vec::new(); log.efforts.len()],
                load: &[],
            }
            .run(&mut consumers)?;
            first_group += scales * log.efforts.len();
            rest = others;
        }
        Ok(())
    }
}

/// Hands the rows of one output to the visitors of its scales, block by block.
struct OutputRows<'a, 'b> {
    visitors: &'a mut [&'b mut dyn RowVisitor],
    first_group: usize,
    effort: &'a [f64],
    /// Derivative of the effort, and the columns with it.
    slope: Option<&'a [f64]>,
    with_slope: Vec<f64>,
    kernels: &'a [Kernel],
    columns: usize,
    block_length: usize,
    blocks: usize,
    net_effort: Vec<f64>,
}

impl RowConsumer for OutputRows<'_, '_> {
    fn take(&mut self, _output: usize, batch: &RowBatch<'_>) -> Result<(), RowsError> {
        let n = batch.centres.len();
        self.net_effort = means(&self.kernels[batch.scale], self.effort, batch.centres.iter().copied());
        let offset = &batch.columns[self.columns * batch.stride..][..n];
        self.net_effort.iter_mut().zip(offset).for_each(|(effort, known)| *effort -= known);
        let mut columns = batch.columns;
        if let Some(slope) = self.slope {
            // In the place of the offset, which was taken off.
            self.with_slope.clear();
            self.with_slope.extend_from_slice(&batch.columns[..self.columns * batch.stride]);
            let slope = means(&self.kernels[batch.scale], slope, batch.centres.iter().copied());
            self.with_slope.extend(slope);
            self.with_slope.resize((self.columns + 1) * batch.stride, 0.0);
            columns = &self.with_slope;
        }
        let mut start = 0;
        while start < n {
            let block_of = |centre: usize| (centre / self.block_length).min(self.blocks - 1);
            let block = block_of(batch.centres[start]);
            let count = batch.centres[start..].iter().take_while(|c| block_of(**c) == block).count();
            let rows = Rows {
                block,
                samples: &batch.centres[start..start + count],
                regressor: &columns[start..],
                stride: batch.stride,
                effort: &self.net_effort[start..start + count],
            };
            self.visitors[batch.scale]
                .take(&rows)
                .map_err(|source| RowsError { group: self.first_group + batch.scale, source })?;
            start += count;
        }
        Ok(())
    }
}
