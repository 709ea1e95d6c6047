//! Shape parameters fitted to the rows of logs: shaped columns at sample rate, then through the kernels of the rows.

use std::ops::Range;

use dynid_model::{EffortModel, ShapeParameter};
use dynid_motion::Channel;
use rayon::prelude::*;

use super::log_rows::{ConditionedLog, LogRows};
use super::reduce::unusable_row;
use super::windows::add_windows;
use super::{Conditioning, ConditioningError, ConditioningSettings, PreparedLog};
use dynid_estimate::separable::{
    OutputPlaces, RowGroup, SeparableError, SeparableEstimate, SeparableProblem, SeparableSettings,
    ShapedColumns, fit, places,
};
use dynid_factor::factor::FactorError;
use dynid_factor::rows::{RowSource, RowVisitor, Rows, visit_all};

/// Samples of a log that one thread takes at a time, at least; twice the reach of the kernels otherwise.
const STRETCH: usize = 8192;
/// Samples whose shaped columns are formed at a time.
const PIECE: usize = 1024;

/// Positions of logs up to which their motion is held between evaluations, 48 MiB of numbers.
const MOST_HELD: usize = 1 << 21;

/// Why shape parameters cannot be fitted to logs.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RefineError {
    /// The rows cannot be formed.
    #[error(transparent)]
    Conditioning(#[from] ConditioningError),
    /// The fit cannot be made.
    #[error(transparent)]
    Separable(#[from] SeparableError),
}

/// Rows of logs whose fixed columns are formed once; shaped columns and their derivatives are formed anew for every
/// shape vector, at the same row centres and through the same kernels.
pub struct ShapedRows<'a> {
    rows: LogRows<'a>,
    places: Vec<OutputPlaces>,
    parameters: Vec<ShapeParameter>,
    linear: usize,
    groups: Vec<RowGroup>,
    /// Per group: samples at which its rows are centred.
    centres: Vec<Vec<usize>>,
}

impl std::fmt::Debug for ShapedRows<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ShapedRows").field("parameters", &self.parameters).finish_non_exhaustive()
    }
}

/// Keeps the fixed columns of a group.
struct Keeper {
    /// Places of the fixed columns among those of the rows.
    fixed: Vec<usize>,
    columns: Vec<Vec<f64>>,
    group: RowGroup,
    centres: Vec<usize>,
}

impl RowVisitor for Keeper {
    fn take(&mut self, rows: &Rows<'_>) -> Result<(), FactorError> {
        let count = rows.effort.len();
        for (place, column) in self.fixed.iter().zip(&mut self.columns) {
            column.extend_from_slice(&rows.regressor[place * rows.stride..][..count]);
        }
        self.group.effort.extend_from_slice(rows.effort);
        self.group.block_rows[rows.block] += count;
        self.centres.extend_from_slice(rows.samples);
        Ok(())
    }
}

impl<'a> ShapedRows<'a> {
    /// Forms the rows. `shape`: start values, brought between the bounds of the model's shape parameters; `kept`: base
    /// columns of the model, ascending; `choices`: found by [`super::condition`] for these logs.
    ///
    /// # Errors
    /// [`ConditioningError`] if a signal cannot be filtered or a row is not finite.
    pub fn new(
        model: &'a dyn EffortModel,
        shape: &'a [f64],
        kept: &[usize],
        logs: &'a [PreparedLog],
        choices: &Conditioning,
        settings: &ConditioningSettings,
    ) -> Result<Self, ConditioningError> {
        let mut rows = LogRows::new(model, shape, kept, logs, choices, settings)?;
        let numbers: usize = rows.logs.iter().map(|log| log.states.samples * log.states.outputs()).sum();
        if numbers <= MOST_HELD {
            rows.logs.iter_mut().for_each(|log| log.states.hold());
        }
        let places = places(model, kept);
        let mut keepers: Vec<Keeper> = rows
            .groups()
            .iter()
            .map(|g| {
                let of_output = &places[g.output];
                let fixed = of_output.fixed.iter().filter_map(|f| g.columns.iter().position(|c| *c == f.1));
                let mut group = of_output.group(g.log, g.output, g.scale);
                group.block_rows = vec![0; g.blocks];
                let columns = vec![Vec::new(); of_output.fixed.len()];
                Keeper { fixed: fixed.collect(), columns, group, centres: Vec::new() }
            })
            .collect();
        visit_all(&rows, &mut keepers).map_err(|e| unusable_row(&rows, e))?;
        let (groups, centres) = keepers
            .into_iter()
            .map(|mut k| {
                k.group.fixed_values = k.columns.concat();
                (k.group, k.centres)
            })
            .unzip();
        let mut parameters = model.parameters().shape.clone();
        parameters.iter_mut().zip(shape).for_each(|(p, start)| p.start = *start);
        Ok(ShapedRows { rows, places, parameters, linear: kept.len(), groups, centres })
    }
}

impl ShapedRows<'_> {
    /// Returns the rows with some shape parameters held at their start.
    ///
    /// # Panics
    /// If there is not one flag per shape parameter.
    #[must_use]
    pub fn holding(mut self, held: &[bool]) -> Self {
        assert_eq!(held.len(), self.parameters.len(), "flags of shape parameters");
        for (parameter, _) in self.parameters.iter_mut().zip(held).filter(|(_, held)| **held) {
            (parameter.lower, parameter.upper) = (parameter.start, parameter.start);
        }
        self
    }
}

/// What a stretch of a log holds of a group's rows.
struct Part {
    /// Rows of the group whose windows reach into the stretch.
    rows: Range<usize>,
    /// Their values, then their derivatives, column-major.
    sums: Vec<f64>,
}

impl ShapedRows<'_> {
    /// What a stretch of a log holds of the rows of its groups.
    fn parts(
        &self,
        log: &ConditionedLog<'_>,
        groups: &[RowGroup],
        centres: &[Vec<usize>],
        stretch: Range<usize>,
        shape: &[f64],
        remembered: &[Channel],
    ) -> Vec<Part> {
        let model = self.rows.model;
        let (shaped, dependent) = (model.shaped_columns().len(), model.shape_dependence().len());
        let mut parts: Vec<Part> = groups
            .iter()
            .zip(centres)
            .map(|(group, centres)| {
                let half_width = log.kernels.kernels[group.scale].half_width();
                let rows = centres.partition_point(|c| c + half_width < stretch.start)
                    ..centres.partition_point(|c| *c < stretch.end + half_width);
                let places = &self.places[group.output];
                let columns = places.shaped.len() + places.dependence.len();
                Part { sums: vec![0.0; columns * rows.len()], rows }
            })
            .collect();
        // Values, then derivatives, each column `PIECE` long.
        let mut all = vec![0.0; (shaped + dependent) * PIECE];
        for start in stretch.clone().step_by(PIECE) {
            let range = start..(start + PIECE).min(stretch.end);
            let count = range.len();
            let (values, derivatives) = all.split_at_mut(shaped * PIECE);
            log.states.with_block(range, &log.log.channels, remembered, |motion| {
                model.shaped(motion, shape, PIECE, values, derivatives);
            });
            let column = |k: usize| &all[k * PIECE..][..count];
            for ((group, centres), part) in groups.iter().zip(centres).zip(&mut parts) {
                let places = &self.places[group.output];
                let values = places.shaped.iter().map(|(index, _)| column(*index));
                let derivatives = places.dependence.iter().map(|(index, ..)| column(shaped + index));
                let columns: Vec<&[f64]> = values.chain(derivatives).collect();
                let kernel = &log.kernels.kernels[group.scale];
                add_windows(kernel, start, &centres[part.rows.clone()], &columns, &mut part.sums);
            }
        }
        parts
    }
}

impl SeparableProblem for ShapedRows<'_> {
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
        let model = self.rows.model;
        for columns in &mut *out {
            columns.clear();
        }
        let mut rest = out;
        let mut first = 0;
        for log in &self.rows.logs {
            let samples = log.states.samples;
            let remembered = log.states.remembered(model, shape, &log.log.channels);
            let (own, others) = rest.split_at_mut(log.kernels.kernels.len() * self.places.len());
            let (groups, centres) = (&self.groups[first..][..own.len()], &self.centres[first..][..own.len()]);
            let stretch = STRETCH.max(2 * log.kernels.kernels[0].half_width());
            let stretches: Vec<Range<usize>> =
                (0..samples).step_by(stretch).map(|s| s..(s + stretch).min(samples)).collect();
            // A few at a time: their sums are held until they are added, in order.
            for stretches in stretches.chunks(4 * rayon::current_num_threads()) {
                let parts: Vec<Vec<Part>> = stretches
                    .par_iter()
                    .map(|range| self.parts(log, groups, centres, range.clone(), shape, &remembered))
                    .collect();
                own.par_iter_mut().zip(groups).enumerate().for_each(|(g, (out, group))| {
                    let places = &self.places[group.output];
                    for Part { rows, sums } in
                        parts.iter().map(|parts| &parts[g]).filter(|p| !p.rows.is_empty())
                    {
                        let mut columns = sums.chunks_exact(rows.len());
                        let add = |to: &mut [f64], from: Option<&[f64]>| {
                            let from = from.into_iter().flatten();
                            to[rows.clone()].iter_mut().zip(from).for_each(|(to, from)| *to += from);
                        };
                        (0..places.shaped.len()).for_each(|k| add(out.value_mut(k), columns.next()));
                        (0..places.dependence.len()).for_each(|d| add(out.derivative_mut(d), columns.next()));
                    }
                });
            }
            first += own.len();
            rest = others;
        }
    }
}

/// Fits the shape parameters of a model, and its base parameters with them, to logs with the choices made.
///
/// Arguments as those of [`ShapedRows::new`]; `separable`: of the fit. Without shape parameters this is weighted least
/// squares.
///
/// # Errors
/// [`RefineError`].
pub fn refine(
    model: &dyn EffortModel,
    shape: &[f64],
    kept: &[usize],
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
    separable: &SeparableSettings,
) -> Result<SeparableEstimate, RefineError> {
    Ok(fit(&ShapedRows::new(model, shape, kept, logs, choices, settings)?, separable)?)
}
