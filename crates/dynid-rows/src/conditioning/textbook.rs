//! The textbook route: zero-phase Butterworth and central differences, or another smoothing of the papers, and decimation.

use dynid_model::{EffortModel, RegressorBlock};
use dynid_motion::filter::{anti_alias, pick};

use super::log_rows::most_blocks;
use super::reduce::unusable_row;
use super::rows::KeptColumns;
use super::states::States;
use super::{ConditioningError, ConditioningSettings, PreparedLog, Smoothing};
use dynid_estimate::instruments::paired_columns;
use dynid_factor::groups::ReducedGroup;
use dynid_factor::rows::{GroupShape, MemoryRows, Rows, reduce_rows};

/// Settings of the textbook route.
#[derive(Debug, Clone, PartialEq)]
pub struct TextbookRoute {
    /// How positions become states. Default: zero-phase Butterworth.
    pub smoothing: Smoothing,
    /// How efforts are smoothed. Default: like positions.
    pub effort_smoothing: Option<Smoothing>,
    /// Cut-off of the zero-phase filter, or of the Fourier series, on positions and efforts, Hz. Default 10.
    pub cutoff_hz: f64,
    /// Order of the filter. Default 4.
    pub order: usize,
    /// Keep every n-th row; default: about five rows per period of the positions' cut-off ([`Smoothing::cutoff_hz`]).
    pub decimation: Option<usize>,
    /// Pass columns and effort through an anti-alias filter before rows are dropped, as MATLAB's `decimate` does.
    /// Default false.
    pub parallel_filter: bool,
    /// Smooth the effort too. Default true.
    pub filter_effort: bool,
    /// Cut from both ends, s. Default 0.2.
    pub trim_s: f64,
}

impl Default for TextbookRoute {
    fn default() -> Self {
        TextbookRoute {
            smoothing: Smoothing::default(),
            effort_smoothing: None,
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
    pub fn factor(&self, log: &PreparedLog) -> usize {
        let found = || (log.rate_hz / (5.0 * self.smoothing.cutoff_hz(self.cutoff_hz, log))).floor() as usize;
        self.decimation.unwrap_or_else(found).max(1)
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
    let mut groups = Vec::new();
    for (l, log) in logs.iter().enumerate() {
        let rows = rows_of(model, shape, kept, std::iter::once((l, log, None)), route, settings)?;
        groups.extend(reduce_rows(&rows).map_err(|e| unusable_row(&rows, e))?);
    }
    Ok(groups)
}

/// Rows of all logs by the textbook route, in memory; one group per log and output, in that order.
pub fn textbook_rows(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    route: &TextbookRoute,
    settings: &ConditioningSettings,
) -> Result<MemoryRows, ConditioningError> {
    let logs = logs.iter().enumerate().map(|(l, log)| (l, log, None));
    rows_of(model, shape, kept, logs, route, settings)
}

/// Rows of the textbook route paired with instruments, `[Z | W | y]`: see [`super::LogRows::with_instruments`].
///
/// `motions`: one per log, per output its positions at the log's samples, rad or m.
///
/// # Panics
/// Unless there is one motion per log with a position per output and sample.
pub fn paired_textbook_rows(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    route: &TextbookRoute,
    motions: &[Vec<Vec<f64>>],
    settings: &ConditioningSettings,
) -> Result<MemoryRows, ConditioningError> {
    assert_eq!(motions.len(), logs.len(), "one motion per log");
    let logs = logs.iter().zip(motions).enumerate().map(|(l, (log, motion))| (l, log, Some(&motion[..])));
    rows_of(model, shape, kept, logs, route, settings)
}

fn rows_of<'a>(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: impl ExactSizeIterator<Item = (usize, &'a PreparedLog, Option<&'a [Vec<f64>]>)>,
    route: &TextbookRoute,
    settings: &ConditioningSettings,
) -> Result<MemoryRows, ConditioningError> {
    let columns = KeptColumns::new(model, kept);
    let settings =
        ConditioningSettings { smoothing: route.smoothing, state_order: route.order, ..settings.clone() };
    let mut out = MemoryRows::new();
    let most = settings.most_blocks.unwrap_or_else(|| most_blocks(logs.len()));
    for (l, log, motion) in logs {
        let effort_smoothing = route.effort_smoothing.unwrap_or(route.smoothing);
        route.smoothing.check(log)?;
        let most_hz = settings.cutoff.state_rate * log.rate_hz;
        let cutoff = |smoothing: Smoothing| smoothing.cutoff_hz(route.cutoff_hz, log).min(most_hz);
        let states = States::of_motion_at(log, cutoff(route.smoothing), &settings)?;
        let samples = log.samples();
        let filled = |states: &States| {
            let mut regressor = RegressorBlock::new(model.layout().clone(), samples);
            let remembered = states.remembered(model, shape, &log.channels);
            states.with_block(0..samples, &log.channels, &remembered, |motion| {
                model.regressor(motion, shape, &mut regressor);
            });
            regressor
        };
        let regressor = filled(&states);
        let instruments =
            motion.map(|m| Ok::<_, ConditioningError>(filled(&states.along(m, &settings)?))).transpose()?;
        let trim = (route.trim_s * log.rate_hz).round() as usize;
        let inside = trim.min(samples)..samples.saturating_sub(trim).max(trim.min(samples));
        let factor = route.factor(log);
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
                effort_smoothing.effort(log, &log.effort[output], cutoff(effort_smoothing), route.order)?
            } else {
                log.effort[output].to_vec()
            };
            let offset = thin(regressor.offset(output))?;
            let effort: Vec<f64> = thin(&effort)?.iter().zip(offset).map(|(e, o)| e - o).collect();
            let thinned = instruments
                .iter()
                .chain([&regressor])
                .flat_map(|block| local.iter().map(|k| thin(block.column(output, *k))))
                .collect::<Result<Vec<_>, _>>()?;
            let positions = &columns.global[output];
            let per_block = ((settings.block_s * log.rate_hz / factor as f64).ceil() as usize)
                .max(effort.len().div_ceil(most))
                .max(1);
            let group = out.add_group(GroupShape {
                log: l,
                output,
                scale: 0,
                columns: match motion {
                    Some(_) => paired_columns(positions, columns.total),
                    None => positions.clone(),
                },
                blocks: effort.len().div_ceil(per_block).max(1),
            });
            for start in (0..effort.len()).step_by(per_block) {
                let end = (start + per_block).min(effort.len());
                let used: Vec<usize> = (start..end).filter(|k| usable[*k] && !log.held[output]).collect();
                let of = |signal: &[f64]| used.iter().map(|k| signal[*k]).collect::<Vec<f64>>();
                let samples: Vec<usize> = used.iter().map(|k| inside.start + k * factor).collect();
                let regressor: Vec<f64> = thinned.iter().flat_map(|column| of(column)).collect();
                out.push(
                    group,
                    &Rows {
                        block: start / per_block,
                        samples: &samples,
                        regressor: &regressor,
                        stride: used.len(),
                        effort: &of(&effort),
                    },
                );
            }
        }
    }
    Ok(out)
}
