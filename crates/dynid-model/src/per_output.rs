//! Every output with parameters of its own.

use std::sync::Arc;

use crate::dynamics::{MotionAdjoint, MotionBlock};
use crate::effort_model::{EffortModel, History, Output, RegressorBlock, RegressorLayout};
use crate::parameter::ParameterTable;
use crate::random_motion::RandomMotion;

/// A model in which no two outputs share a linear parameter: the columns of output after output, each a copy of the
/// parameters that act there, named `<output>: <parameter>`.
///
/// Fits of drives whose gains are unknown need it: with `i_j = (W_j x)/g_j` every current sees parameters `x/g_j` of its own.
/// Shape parameters stay shared.
#[derive(Debug)]
pub struct PerOutput<'a, M: ?Sized> {
    model: &'a M,
    parameters: ParameterTable,
    layout: Arc<RegressorLayout>,
    /// Column of the model that every column copies.
    source: Vec<usize>,
    /// First column of every output, and the end.
    first: Vec<usize>,
    shaped: Vec<(usize, usize)>,
}

impl<'a, M: EffortModel + ?Sized> PerOutput<'a, M> {
    /// The copy of a model.
    pub fn new(model: &'a M) -> Self {
        let inner = model.layout();
        let table = model.parameters();
        let (mut linear, mut source, mut columns) = (Vec::new(), Vec::new(), Vec::new());
        let mut first = vec![0];
        for (output, Output { name, .. }) in model.outputs().iter().enumerate() {
            let own = inner.columns(output);
            columns.push((linear.len()..linear.len() + own.len()).collect());
            for column in own {
                let mut parameter = table.linear[*column].clone();
                parameter.name = format!("{name}: {}", parameter.name);
                linear.push(parameter);
                source.push(*column);
            }
            first.push(linear.len());
        }
        let layout = Arc::new(RegressorLayout::new(columns, linear.len()));
        let own = |output: usize, column: usize| {
            let range = first[output]..first[output + 1];
            range.start + source[range].iter().position(|c| *c == column).unwrap_or_default()
        };
        let shaped = model.shaped_columns().iter().map(|(o, c)| (*o, own(*o, *c))).collect();
        let parameters = ParameterTable { linear, shape: table.shape.clone() };
        PerOutput { model, parameters, layout, source, first, shaped }
    }

    /// Columns of an output.
    ///
    /// # Panics
    /// If there is no such output.
    pub fn columns(&self, output: usize) -> std::ops::Range<usize> {
        self.first[output]..self.first[output + 1]
    }

    /// Column of the model that a column copies.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn source(&self, column: usize) -> usize {
        self.source[column]
    }

    /// Parameters of the model as one output has them; zero where none acts there.
    fn of_output(&self, output: usize, linear: &[f64]) -> Vec<f64> {
        let mut own = vec![0.0; self.model.parameters().linear.len()];
        for column in self.columns(output) {
            own[self.source[column]] = linear[column];
        }
        own
    }
}

impl<M: EffortModel + ?Sized> EffortModel for PerOutput<'_, M> {
    fn outputs(&self) -> &[Output] {
        self.model.outputs()
    }
    fn parameters(&self) -> &ParameterTable {
        &self.parameters
    }
    fn layout(&self) -> &Arc<RegressorLayout> {
        &self.layout
    }
    fn channels(&self) -> &[String] {
        self.model.channels()
    }
    fn signals(&self) -> &[String] {
        self.model.signals()
    }
    fn remember(
        &self,
        motion: &MotionBlock<'_>,
        step_s: f64,
        shape: &[f64],
        history: &mut History,
        stride: usize,
        out: &mut [f64],
    ) {
        self.model.remember(motion, step_s, shape, history, stride, out);
    }
    fn random_motion(&self, samples: usize, seed: u64) -> RandomMotion {
        self.model.random_motion(samples, seed)
    }
    fn dimensions(&self) -> (usize, usize) {
        self.model.dimensions()
    }
    fn travels(&self) -> &[f64] {
        self.model.travels()
    }
    fn is_undriven(&self, output: usize) -> bool {
        self.model.is_undriven(output)
    }
    fn reversal_speeds(&self, output: usize) -> Vec<Vec<(usize, f64)>> {
        self.model.reversal_speeds(output)
    }
    fn regressor(&self, motion: &MotionBlock<'_>, shape: &[f64], out: &mut RegressorBlock) {
        let mut own = RegressorBlock::new(self.model.layout().clone(), motion.samples);
        self.model.regressor(motion, shape, &mut own);
        out.start(&self.layout, motion.samples);
        for output in 0..self.first.len() - 1 {
            for k in 0..self.columns(output).len() {
                out.column_mut(output, k).copy_from_slice(own.column(output, k));
            }
            out.offset_mut(output).copy_from_slice(own.offset(output));
        }
    }
    fn shaped_columns(&self) -> &[(usize, usize)] {
        &self.shaped
    }
    fn shape_dependence(&self) -> &[(usize, usize)] {
        self.model.shape_dependence()
    }
    fn shaped(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        stride: usize,
        values: &mut [f64],
        derivatives: &mut [f64],
    ) {
        self.model.shaped(motion, shape, stride, values, derivatives);
    }
    fn efforts(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        effort: &mut [f64],
    ) {
        assert_eq!(linear.len(), self.parameters.linear.len(), "length of linear");
        let mut block = RegressorBlock::new(self.layout.clone(), motion.samples);
        self.regressor(motion, shape, &mut block);
        for output in 0..self.first.len() - 1 {
            effort[output * stride..][..motion.samples].copy_from_slice(&block.effort(output, linear));
        }
    }
    fn effort_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        linear: &[f64],
        stride: usize,
        weights: &[f64],
        out: &mut MotionAdjoint,
    ) {
        assert_eq!(linear.len(), self.parameters.linear.len(), "length of linear");
        let n = motion.samples;
        for output in 0..self.first.len() - 1 {
            let mut own = vec![0.0; (self.first.len() - 1) * n];
            own[output * n..][..n].copy_from_slice(&weights[output * stride..][..n]);
            let linear = self.of_output(output, linear);
            self.model.effort_adjoint(motion, shape, &linear, n, &own, out);
        }
    }
    fn regressor_adjoint(
        &self,
        motion: &MotionBlock<'_>,
        shape: &[f64],
        weights: &RegressorBlock,
        out: &mut MotionAdjoint,
    ) {
        assert_eq!(*weights.layout(), *self.layout, "weights of another model");
        let mut own = RegressorBlock::new(self.model.layout().clone(), motion.samples);
        own.set_samples(motion.samples);
        for output in 0..self.first.len() - 1 {
            for k in 0..self.columns(output).len() {
                own.column_mut(output, k).copy_from_slice(weights.column(output, k));
            }
        }
        self.model.regressor_adjoint(motion, shape, &own, out);
    }
}
