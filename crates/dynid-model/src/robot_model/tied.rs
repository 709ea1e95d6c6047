//! Columns of a model whose parameters are tied: `W T` from the columns `W` of all parameters.

use std::sync::Arc;

use crate::dynamics::MotionBlock;
use crate::effort_model::{EffortModel, RegressorBlock, RegressorLayout};
use crate::ties::{Dependent, TieError, Ties};

/// A part of a tied column: an acting column of the same output, times a factor.
type Part = (usize, f64);

/// A shaped column of the tied model.
#[derive(Debug)]
struct ShapedColumn {
    output: usize,
    /// Shaped columns of the whole model.
    shaped: Vec<Part>,
    /// Acting columns of the output that no shape parameter changes.
    fixed: Vec<Part>,
}

/// How columns of the tied model follow from those of the whole one.
#[derive(Debug)]
pub(super) struct Tied {
    pub(super) ties: Ties,
    pub(super) layout: Arc<RegressorLayout>,
    /// Per output and acting column.
    parts: Vec<Vec<Vec<Part>>>,
    /// Per output: what known values add to the offset.
    constants: Vec<Vec<Part>>,
    pub(super) shaped: Vec<(usize, usize)>,
    shaped_columns: Vec<ShapedColumn>,
    pub(super) dependence: Vec<(usize, usize)>,
    /// Per pair: pairs of the whole model.
    derivatives: Vec<Vec<Part>>,
}

impl Tied {
    pub(super) fn new(model: &dyn EffortModel, ties: Ties) -> Result<Self, TieError> {
        let layout = model.layout();
        let (mut columns, mut parts, mut constants) = (Vec::new(), Vec::new(), Vec::new());
        for output in 0..layout.outputs() {
            let mut own: Vec<(usize, Vec<Part>)> = Vec::new();
            let mut known = Vec::new();
            for (place, column) in layout.columns(output).iter().enumerate() {
                match ties.of_column(*column) {
                    None => put(&mut own, *column, (place, 1.0)),
                    Some(dependent) => {
                        dependent.terms.iter().for_each(|(free, f)| put(&mut own, *free, (place, *f)));
                        if dependent.constant != 0.0 {
                            known.push((place, dependent.constant));
                        }
                    }
                }
            }
            own.sort_by_key(|(column, _)| *column);
            let (of_output, of_column): (Vec<usize>, Vec<Vec<Part>>) = own.into_iter().unzip();
            columns.push(of_output);
            parts.push(of_column);
            constants.push(known);
        }
        let tied_layout = RegressorLayout::new(columns, layout.parameters());
        let mut out = Tied {
            layout: Arc::new(tied_layout),
            ties,
            parts,
            constants,
            shaped: Vec::new(),
            shaped_columns: Vec::new(),
            dependence: Vec::new(),
            derivatives: Vec::new(),
        };
        out.place_shapes(model)?;
        Ok(out)
    }

    fn place_shapes(&mut self, model: &dyn EffortModel) -> Result<(), TieError> {
        let (layout, whole) = (model.layout(), model.shaped_columns());
        let is_shaped = |output: usize, place: usize| {
            let column = layout.columns(output)[place];
            whole.iter().position(|s| *s == (output, column))
        };
        for (output, known) in self.constants.iter().enumerate() {
            for (place, constant) in known {
                let Some(shaped) = is_shaped(output, *place) else { continue };
                let searched = model.shape_dependence().iter().filter(|(s, _)| *s == shaped);
                let mut searched = searched.map(|(_, k)| *k).filter(|k| self.is_searched(model, *k));
                if let Some(shape) = searched.next() {
                    return Err(TieError::KnownShaped {
                        parameter: model.parameters().linear[layout.columns(output)[*place]].name.clone(),
                        constant: *constant,
                        shape: model.parameters().shape[shape].name.clone(),
                    });
                }
            }
        }
        for output in 0..self.layout.outputs() {
            for (k, column) in self.layout.columns(output).iter().enumerate() {
                let mut own = ShapedColumn { output, shaped: Vec::new(), fixed: Vec::new() };
                for (place, factor) in &self.parts[output][k] {
                    match is_shaped(output, *place) {
                        Some(shaped) => own.shaped.push((shaped, *factor)),
                        None => own.fixed.push((*place, *factor)),
                    }
                }
                if own.shaped.is_empty() {
                    continue;
                }
                self.shaped.push((output, *column));
                self.shaped_columns.push(own);
            }
        }
        let mut pairs: Vec<((usize, usize), Vec<Part>)> = Vec::new();
        for (k, column) in self.shaped_columns.iter().enumerate() {
            for (d, (shaped, shape)) in model.shape_dependence().iter().enumerate() {
                for (_, factor) in column.shaped.iter().filter(|(s, _)| s == shaped) {
                    match self.ties.of_shape(*shape) {
                        None => put(&mut pairs, (k, *shape), (d, *factor)),
                        Some(Dependent { terms, .. }) => {
                            terms.iter().for_each(|(free, f)| put(&mut pairs, (k, *free), (d, factor * f)));
                        }
                    }
                }
            }
        }
        (self.dependence, self.derivatives) = pairs.into_iter().unzip();
        Ok(())
    }

    /// Whether a search may move a shape parameter.
    fn is_searched(&self, model: &dyn EffortModel, shape: usize) -> bool {
        let searched = |k: usize| model.parameters().shape[k].lower < model.parameters().shape[k].upper;
        match self.ties.of_shape(shape) {
            None => searched(shape),
            Some(dependent) => dependent.terms.iter().any(|(k, _)| searched(*k)),
        }
    }

    pub(super) fn regressor(
        &self,
        model: &dyn EffortModel,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        out: &mut RegressorBlock,
    ) {
        let mut whole = RegressorBlock::new(model.layout().clone(), motion.samples);
        model.regressor(motion, shape, &mut whole);
        out.start(&self.layout, motion.samples);
        for (output, columns) in self.parts.iter().enumerate() {
            out.offset_mut(output).copy_from_slice(whole.offset(output));
            for (place, constant) in &self.constants[output] {
                add(out.offset_mut(output), *constant, whole.column(output, *place));
            }
            for (k, parts) in columns.iter().enumerate() {
                let column = out.column_mut(output, k);
                column.fill(0.0);
                parts.iter().for_each(|(place, f)| add(column, *f, whole.column(output, *place)));
            }
        }
    }

    pub(super) fn shaped(
        &self,
        model: &dyn EffortModel,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        let n = motion.samples;
        let room =
            |wanted: &[f64], columns: usize| vec![0.0; if wanted.is_empty() { 0 } else { columns * n }];
        let mut whole = room(values, model.shaped_columns().len());
        let mut slopes = room(derivatives, model.shape_dependence().len());
        model.shaped(motion, shape, n, &mut whole, &mut slopes);
        let rigid =
            (!values.is_empty() && self.shaped_columns.iter().any(|c| !c.fixed.is_empty())).then(|| {
                let mut block = RegressorBlock::new(model.layout().clone(), n);
                model.regressor(motion, shape, &mut block);
                block
            });
        if !values.is_empty() {
            for (k, column) in self.shaped_columns.iter().enumerate() {
                let to = &mut values[k * stride..][..n];
                to.fill(0.0);
                column.shaped.iter().for_each(|(s, f)| add(to, *f, &whole[s * n..][..n]));
                if let Some(block) = &rigid {
                    column
                        .fixed
                        .iter()
                        .for_each(|(place, f)| add(to, *f, block.column(column.output, *place)));
                }
            }
        }
        if !derivatives.is_empty() {
            for (k, parts) in self.derivatives.iter().enumerate() {
                let to = &mut derivatives[k * stride..][..n];
                to.fill(0.0);
                parts.iter().for_each(|(d, f)| add(to, *f, &slopes[d * n..][..n]));
            }
        }
    }

    /// Weights of the whole regressor that do what `weights` do on the tied one.
    pub(super) fn spread(&self, model: &dyn EffortModel, weights: &RegressorBlock) -> RegressorBlock {
        assert_eq!(*weights.layout(), *self.layout, "weights of another model");
        let mut whole = RegressorBlock::new(model.layout().clone(), weights.samples());
        whole.start(model.layout(), weights.samples());
        for output in 0..self.layout.outputs() {
            for place in 0..model.layout().columns(output).len() {
                whole.column_mut(output, place).fill(0.0);
            }
            for (k, parts) in self.parts[output].iter().enumerate() {
                for (place, factor) in parts {
                    add(whole.column_mut(output, *place), *factor, weights.column(output, k));
                }
            }
        }
        whole
    }
}

fn put<K: PartialEq>(list: &mut Vec<(K, Vec<Part>)>, key: K, part: Part) {
    match list.iter_mut().find(|(k, _)| *k == key) {
        Some((_, parts)) => parts.push(part),
        None => list.push((key, vec![part])),
    }
}

fn add(to: &mut [f64], factor: f64, from: &[f64]) {
    to.iter_mut().zip(from).for_each(|(t, f)| *t += factor * f);
}
