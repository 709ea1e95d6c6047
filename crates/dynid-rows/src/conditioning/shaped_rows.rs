//! Shape parameters fitted to the rows of logs: shaped columns at sample rate, then through the kernels of the rows.

use dynid_model::{EffortModel, ShapeParameter};
use rayon::prelude::*;

use super::log_rows::LogRows;
use super::reduce::unusable_row;
use super::{Conditioning, ConditioningError, ConditioningSettings, PreparedLog};
use dynid_estimate::separable::{
    OutputPlaces, RowGroup, SeparableError, SeparableEstimate, SeparableProblem, SeparableSettings,
    ShapedColumns, fit, places,
};
use dynid_factor::factor::FactorError;
use dynid_factor::rows::{RowSource, RowVisitor, Rows, visit_all};

/// Samples whose shaped columns are formed at a time.
const CHUNK: usize = 4096;

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
        let rows = LogRows::new(model, shape, kept, logs, choices, settings)?;
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
        let (shaped, dependent) = (model.shaped_columns().len(), model.shape_dependence().len());
        let mut rest = out;
        let mut first = 0;
        for log in &self.rows.logs {
            let samples = log.states.samples;
            let remembered = log.states.remembered(model, shape, &log.log.channels);
            // Chunk after chunk: values, then derivatives, each column `CHUNK` long.
            let chunks: Vec<Vec<f64>> = (0..samples.div_ceil(CHUNK))
                .into_par_iter()
                .map(|c| {
                    let range = c * CHUNK..((c + 1) * CHUNK).min(samples);
                    let mut all = vec![0.0; (shaped + dependent) * CHUNK];
                    let (values, derivatives) = all.split_at_mut(shaped * CHUNK);
                    log.states.with_block(range, &log.log.channels, &remembered, |motion| {
                        model.shaped(motion, shape, CHUNK, values, derivatives);
                    });
                    all
                })
                .collect();
            let signal = |column: usize| {
                let parts = chunks.iter().flat_map(|c| c[column * CHUNK..][..CHUNK].iter().copied());
                parts.take(samples).collect::<Vec<f64>>()
            };
            let (own, others) = rest.split_at_mut(log.kernels.kernels.len() * self.places.len());
            own.par_iter_mut().enumerate().for_each(|(g, out)| {
                let (group, centres) = (&self.groups[first + g], &self.centres[first + g]);
                let (places, kernel) = (&self.places[group.output], &log.kernels.kernels[group.scale]);
                if centres.is_empty() {
                    return;
                }
                for (k, (index, _)) in places.shaped.iter().enumerate() {
                    kernel.apply_block(&signal(*index), 0, centres, out.value_mut(k));
                }
                for (d, (index, ..)) in places.dependence.iter().enumerate() {
                    kernel.apply_block(&signal(shaped + index), 0, centres, out.derivative_mut(d));
                }
            });
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
