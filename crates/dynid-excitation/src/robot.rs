//! Robots as models to design for: base columns of their regressor.

use dynid_linalg::Mat;
use dynid_model::{BaseParameters, EffortModel, MotionAdjoint, MotionBlock, RegressorBlock, RobotModel};

use crate::model::{ColumnInfo, ExcitationModel, Sensitivity};

/// Base parameters of a robot: inertial, drive and friction columns that motion can reveal.
#[derive(Debug, Clone)]
pub struct RobotExcitation {
    model: std::sync::Arc<RobotModel>,
    shape: Vec<f64>,
    /// Parameter columns, one per column of `W`.
    kept: Vec<usize>,
    columns: Vec<ColumnInfo>,
    /// Per output and acting column: its place among the kept.
    places: Vec<Vec<Option<usize>>>,
}

impl RobotExcitation {
    /// The base parameters of `model`. `nominal`: values of all its parameters, if known; nominal base values follow.
    ///
    /// # Panics
    /// If `nominal` has the wrong length, or the model has a floating base.
    pub fn new(
        model: std::sync::Arc<RobotModel>,
        shape: Vec<f64>,
        base: &BaseParameters,
        nominal: Option<&[f64]>,
    ) -> Self {
        let mut excitation = Self::of_columns(model, shape, base.kept.clone());
        if let Some(nominal) = nominal {
            for (column, value) in excitation.columns.iter_mut().zip(base.values(nominal)) {
                column.nominal = Some(value);
            }
        }
        excitation
    }

    /// Some parameter columns of `model`, ascending.
    ///
    /// # Panics
    /// If a column does not exist, or the model has a floating base.
    pub fn of_columns(model: std::sync::Arc<RobotModel>, shape: Vec<f64>, kept: Vec<usize>) -> Self {
        let (positions, rates) = model.dimensions();
        assert_eq!(positions, rates, "excitation of a floating base");
        let table = model.parameters();
        let column = |c: &usize| ColumnInfo {
            name: table.linear[*c].name.clone(),
            unit: table.linear[*c].unit.to_owned(),
            nominal: None,
        };
        let columns = kept.iter().map(column).collect();
        let layout = model.layout();
        let places = (0..layout.outputs())
            .map(|o| layout.columns(o).iter().map(|c| kept.binary_search(c).ok()).collect())
            .collect();
        RobotExcitation { shape, kept, columns, places, model }
    }

    /// The effort model.
    pub fn model(&self) -> &RobotModel {
        &self.model
    }
}

impl ExcitationModel for RobotExcitation {
    fn coordinates(&self) -> usize {
        self.model.dimensions().1
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
        let mut block = RegressorBlock::new(self.model.layout().clone(), samples);
        self.model.regressor(motion, &self.shape, &mut block);
        w.fill(0.0);
        for (output, places) in self.places.iter().enumerate() {
            for (k, place) in places.iter().enumerate() {
                if let Some(place) = place {
                    w.col_mut(*place)[output * samples..][..samples].copy_from_slice(block.column(output, k));
                }
            }
        }
    }

    fn adjoint(&self, motion: &MotionBlock<'_>, sensitivity: Sensitivity<'_>, out: &mut MotionAdjoint) {
        let samples = motion.samples;
        match sensitivity {
            Sensitivity::Full(g) => {
                let mut weights = RegressorBlock::new(self.model.layout().clone(), samples);
                weights.set_samples(samples);
                for (output, places) in self.places.iter().enumerate() {
                    for (k, place) in places.iter().enumerate() {
                        let to = weights.column_mut(output, k);
                        match place {
                            Some(place) => {
                                to.copy_from_slice(&g.col(*place)[output * samples..][..samples]);
                            }
                            None => to.fill(0.0),
                        }
                    }
                }
                self.model.regressor_adjoint(motion, &self.shape, &weights, out);
            }
            Sensitivity::Outer(terms) => {
                for (u, v) in terms {
                    let mut linear = vec![0.0; self.model.layout().parameters()];
                    for (column, x) in self.kept.iter().zip(v) {
                        linear[*column] = *x;
                    }
                    self.model.effort_adjoint(motion, &self.shape, &linear, samples, u, out);
                }
            }
        }
    }
}
