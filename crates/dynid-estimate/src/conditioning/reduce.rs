//! Rows of the final fit into triangular factors, one per log, output, scale and time block.

use dynid_model::EffortModel;
use dynid_motion::{Kernel, shift};

use super::rows::{KeptColumns, Kernels, Pass, RowBatch, RowConsumer, masks};
use super::states::States;
use super::{Conditioning, ConditioningError, ConditioningSettings, PreparedLog};
use crate::factor::{Factor, FactorBuilder};

/// Most time blocks per log.
const MAX_BLOCKS: usize = 64;

/// Factors of one output of one log at one kernel scale, all in the base columns that act on the output.
#[derive(Debug, Clone)]
pub struct ReducedGroup {
    /// Index of the log.
    pub log: usize,
    /// Index of the output.
    pub output: usize,
    /// Index of the kernel scale, 0 = widest.
    pub scale: usize,
    /// Base columns that the factors' columns stand for.
    pub columns: Vec<usize>,
    /// One factor per time block of the log.
    pub blocks: Vec<Factor>,
}

impl ReducedGroup {
    /// All time blocks merged, in all `total` base columns.
    pub fn merged(&self, total: usize) -> Factor {
        Factor::merge(&self.blocks.iter().collect::<Vec<_>>()).embed(total, &self.columns)
    }

    /// Rows of all blocks.
    pub fn rows(&self) -> usize {
        self.blocks.iter().map(Factor::rows).sum()
    }
}

struct FactorConsumer<'a> {
    effort: &'a [f64],
    kernels: &'a [Kernel],
    columns: usize,
    block_length: usize,
    blocks: usize,
    /// Per scale: the open builder, the block it belongs to, the finished blocks.
    open: Vec<(FactorBuilder, usize, Vec<Factor>)>,
    row: Vec<f64>,
}

impl FactorConsumer<'_> {
    fn finish_until(&mut self, scale: usize, block: usize) {
        let (builder, current, done) = &mut self.open[scale];
        while *current < block {
            done.push(builder.take());
            *current += 1;
        }
    }
}

impl RowConsumer for FactorConsumer<'_> {
    fn take(&mut self, output: usize, batch: &RowBatch<'_>) -> Result<(), ConditioningError> {
        let n = batch.centres.len();
        let mut start = 0;
        while start < n {
            let block = (batch.centres[start] / self.block_length).min(self.blocks - 1);
            let end = start
                + batch.centres[start..]
                    .iter()
                    .take_while(|c| (*c / self.block_length).min(self.blocks - 1) == block)
                    .count();
            self.finish_until(batch.scale, block);
            let kernel = &self.kernels[batch.scale];
            self.row.clear();
            self.row.extend(batch.centres[start..end].iter().enumerate().map(|(r, centre)| {
                kernel.apply_at(self.effort, *centre) - batch.columns[self.columns * n + start + r]
            }));
            let effort = &self.row;
            let (columns, builder) = (self.columns, &mut self.open[batch.scale].0);
            builder
                .push_with(end - start, |column, range, out| {
                    let source = if column < columns {
                        &batch.columns[column * n + start..][range]
                    } else {
                        &effort[range]
                    };
                    out.copy_from_slice(source);
                })
                .map_err(|source| ConditioningError::Rows { output, source })?;
            start = end;
        }
        Ok(())
    }
}

/// Reduces all logs with the choices made.
pub fn reduce(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
) -> Result<Vec<ReducedGroup>, ConditioningError> {
    let settings = &super::with_given_mask(settings);
    let columns = KeptColumns::new(model, kept);
    let outputs = model.outputs().len();
    let wanted: Vec<u8> = choices.rung.iter().map(|r| 1 << r).collect();
    let mut groups = Vec::new();
    for (l, log) in logs.iter().enumerate() {
        let states = States::new(log, choices.state_hz[l], settings)?;
        let masks = masks(log, &states, model, settings);
        let reach = choices.delay.samples.abs().ceil() as usize + 3;
        let kernels = Kernels::new(&choices.scales_hz, &states, reach)?;
        let efforts = states
            .effort
            .iter()
            .map(|e| Ok(shift::shift(e, -choices.delay.samples)?.values))
            .collect::<Result<Vec<Vec<f64>>, ConditioningError>>()?;
        let longest = (settings.block_s * log.rate_hz).max(5.0 * log.rate_hz / choices.kernel_hz);
        let block_length = (longest.ceil() as usize).max(log.samples().div_ceil(MAX_BLOCKS)).max(1);
        let blocks = (log.samples() / block_length).max(1);
        let mut consumers: Vec<FactorConsumer<'_>> = (0..outputs)
            .map(|j| FactorConsumer {
                effort: &efforts[j],
                kernels: &kernels.kernels,
                columns: columns.local[j].len(),
                block_length,
                blocks,
                open: kernels
                    .kernels
                    .iter()
                    .map(|_| (FactorBuilder::with_chunk_rows(columns.local[j].len(), 256), 0, Vec::new()))
                    .collect(),
                row: Vec::new(),
            })
            .collect();
        Pass {
            model,
            shape,
            columns: &columns,
            log,
            states: &states,
            masks: &masks,
            kernels: &kernels,
            wanted: &wanted,
            probes: false,
        }
        .run(&mut consumers)?;
        for (output, mut consumer) in consumers.into_iter().enumerate() {
            for scale in 0..kernels.kernels.len() {
                consumer.finish_until(scale, blocks);
                let done = std::mem::take(&mut consumer.open[scale].2);
                let columns = columns.global[output].clone();
                groups.push(ReducedGroup { log: l, output, scale, columns, blocks: done });
            }
        }
    }
    Ok(groups)
}
