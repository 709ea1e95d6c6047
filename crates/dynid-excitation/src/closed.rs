//! Mechanisms with loops as models to design for: combinations of the columns of their regressor.

use std::sync::Arc;

use dynid_linalg::Mat;
use dynid_model::{ClosedModel, EffortModel, MotionAdjoint, MotionBlock, RegressorBlock};

use crate::model::{ColumnInfo, ExcitationModel, Sensitivity};

/// A linear combination of a model's parameters that counts as one: `linear = factors · value`.
#[derive(Debug, Clone, PartialEq)]
pub struct TiedColumn {
    /// Name, unit and nominal value.
    pub info: ColumnInfo,
    /// One factor per linear parameter of the model.
    pub factors: Vec<f64>,
}

/// Tied columns of a mechanism with loops. Coordinates are its independent ones: drives, or the pose of a platform.
///
/// Where a pose is out of reach, entries are not numbers; searches take that for a step too far.
#[derive(Debug, Clone)]
pub struct ClosedExcitation {
    model: Arc<ClosedModel>,
    shape: Vec<f64>,
    factors: Vec<Vec<f64>>,
    columns: Vec<ColumnInfo>,
}

impl ClosedExcitation {
    /// Columns of `model` at given shape parameters.
    ///
    /// # Panics
    /// If a column has another number of factors than the model has linear parameters, the mechanism more drives than free
    /// motions, or a joint floats.
    pub fn new(model: Arc<ClosedModel>, shape: Vec<f64>, columns: Vec<TiedColumn>) -> Self {
        let (machine, parameters) = (model.machine(), model.layout().parameters());
        assert_eq!(
            machine.driven().len(),
            machine.mobility(),
            "drives that share out efforts among themselves"
        );
        let tree = machine.mechanism();
        assert_eq!(tree.positions(), tree.rates(), "excitation of a joint that floats");
        let (columns, factors): (Vec<ColumnInfo>, Vec<Vec<f64>>) =
            columns.into_iter().map(|c| (c.info, c.factors)).unzip();
        for own in &factors {
            assert_eq!(own.len(), parameters, "factors of a column");
        }
        ClosedExcitation { model, shape, factors, columns }
    }

    /// The effort model.
    pub fn model(&self) -> &Arc<ClosedModel> {
        &self.model
    }
}

impl ExcitationModel for ClosedExcitation {
    fn coordinates(&self) -> usize {
        self.model.machine().mobility()
    }

    fn outputs(&self) -> usize {
        self.model.outputs().len()
    }

    fn columns(&self) -> &[ColumnInfo] {
        &self.columns
    }

    fn observe(&self, motion: &MotionBlock<'_>, w: &mut Mat) {
        let samples = motion.samples;
        assert_eq!((w.nrows(), w.ncols()), (self.outputs() * samples, self.columns.len()), "size of W");
        let layout = self.model.layout();
        let mut block = RegressorBlock::new(layout.clone(), samples);
        self.model.regressor(motion, &self.shape, &mut block);
        w.fill(0.0);
        for output in 0..self.outputs() {
            for (k, parameter) in layout.columns(output).iter().enumerate() {
                for (column, factors) in self.factors.iter().enumerate() {
                    let factor = factors[*parameter];
                    if factor != 0.0 {
                        let to = &mut w.col_mut(column)[output * samples..][..samples];
                        to.iter_mut().zip(block.column(output, k)).for_each(|(t, x)| *t += factor * x);
                    }
                }
            }
        }
    }

    fn adjoint(&self, motion: &MotionBlock<'_>, sensitivity: Sensitivity<'_>, out: &mut MotionAdjoint) {
        let samples = motion.samples;
        let layout = self.model.layout();
        match sensitivity {
            Sensitivity::Full(g) => {
                let mut weights = RegressorBlock::new(layout.clone(), samples);
                weights.set_samples(samples);
                for output in 0..self.outputs() {
                    for (k, parameter) in layout.columns(output).iter().enumerate() {
                        let to = weights.column_mut(output, k);
                        to.fill(0.0);
                        for (column, factors) in self.factors.iter().enumerate() {
                            let factor = factors[*parameter];
                            if factor != 0.0 {
                                let from = &g.col(column)[output * samples..][..samples];
                                to.iter_mut().zip(from).for_each(|(t, x)| *t += factor * x);
                            }
                        }
                    }
                }
                self.model.regressor_adjoint(motion, &self.shape, &weights, out);
            }
            Sensitivity::Outer(terms) => {
                for (u, v) in terms {
                    let mut linear = vec![0.0; layout.parameters()];
                    for (factors, value) in self.factors.iter().zip(v) {
                        linear.iter_mut().zip(factors).for_each(|(l, f)| *l += f * value);
                    }
                    self.model.effort_adjoint(motion, &self.shape, &linear, samples, u, out);
                }
            }
        }
    }
}
