//! The textbook route: zero-phase Butterworth, central differences, decimation; for comparison with papers.

use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::filter::{anti_alias, butterworth, forward_backward, pick};

use super::rows::KeptColumns;
use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog, ReducedGroup};
use crate::factor::FactorBuilder;

/// Settings of the textbook route.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookRoute {
    /// Cut-off of the zero-phase filter on positions and efforts, Hz. Default 10.
    pub cutoff_hz: f64,
    /// Order of the filter. Default 4.
    pub order: usize,
    /// Keep every n-th row; default: about five times the cut-off.
    pub decimation: Option<usize>,
    /// Pass columns and effort through an anti-alias filter before rows are dropped, as MATLAB's `decimate` does.
    /// Default false.
    pub parallel_filter: bool,
    /// Filter the effort by the Butterworth filter too. Default true.
    pub filter_effort: bool,
    /// Cut from both ends, s. Default 0.2.
    pub trim_s: f64,
}

impl Default for TextbookRoute {
    fn default() -> Self {
        TextbookRoute {
            cutoff_hz: 10.0,
            order: 4,
            decimation: None,
            parallel_filter: false,
            filter_effort: true,
            trim_s: 0.2,
        }
    }
}

impl TextbookRoute {
    /// Rows dropped between kept ones.
    pub fn factor(&self, rate_hz: f64) -> usize {
        self.decimation.unwrap_or_else(|| (rate_hz / (5.0 * self.cutoff_hz)).floor() as usize).max(1)
    }
}

/// Reduces all logs by the textbook route.
pub fn reduce_textbook(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    route: &TextbookRoute,
    settings: &ConditioningSettings,
) -> Result<Vec<ReducedGroup>, ConditioningError> {
    let columns = KeptColumns::new(model, kept);
    let settings = ConditioningSettings { state_order: route.order, ..settings.clone() };
    let mut groups = Vec::new();
    for (l, log) in logs.iter().enumerate() {
        let cutoff = route.cutoff_hz.min(settings.cutoff.state_rate * log.rate_hz);
        let states = States::new(log, cutoff, &settings)?;
        let filter = butterworth(route.order, cutoff, log.rate_hz)?;
        let samples = log.samples();
        let mut regressor = RegressorBlock::new(model.layout().clone(), samples);
        states.with_block(0..samples, &log.channels, |motion| {
            model.regressor(motion, shape, &mut regressor);
        });
        let trim = (route.trim_s * log.rate_hz).round() as usize;
        let inside = trim.min(samples)..samples.saturating_sub(trim).max(trim.min(samples));
        let factor = route.factor(log.rate_hz);
        let thin = |signal: &[f64]| -> Result<Vec<f64>, ConditioningError> {
            let signal = &signal[inside.clone()];
            Ok(if route.parallel_filter && factor > 1 {
                pick(&anti_alias(signal, factor)?, factor, 0)
            } else {
                pick(signal, factor, 0)
            })
        };
        let usable = pick(&log.usable[inside.clone()], factor, 0);
        for (output, local) in columns.local.iter().enumerate() {
            let effort = if route.filter_effort {
                forward_backward(&filter, &log.effort[output])?
            } else {
                log.effort[output].clone()
            };
            let offset = thin(regressor.offset(output))?;
            let effort: Vec<f64> = thin(&effort)?.iter().zip(offset).map(|(e, o)| e - o).collect();
            let thinned =
                local.iter().map(|k| thin(regressor.column(output, *k))).collect::<Result<Vec<_>, _>>()?;
            let per_block = ((settings.block_s * log.rate_hz / factor as f64).ceil() as usize)
                .max(effort.len().div_ceil(64));
            let mut blocks = Vec::new();
            let mut builder = FactorBuilder::with_chunk_rows(local.len(), 256);
            let mut row = vec![0.0; local.len()];
            for (k, y) in effort.iter().enumerate() {
                if k > 0 && k % per_block.max(1) == 0 {
                    blocks.push(builder.take());
                }
                if !usable[k] {
                    continue;
                }
                for (r, column) in row.iter_mut().zip(&thinned) {
                    *r = column[k];
                }
                builder.push_row(&row, *y).map_err(|source| ConditioningError::Rows { output, source })?;
            }
            blocks.push(builder.take());
            groups.push(ReducedGroup {
                log: l,
                output,
                scale: 0,
                columns: columns.global[output].clone(),
                blocks,
            });
        }
    }
    Ok(groups)
}
