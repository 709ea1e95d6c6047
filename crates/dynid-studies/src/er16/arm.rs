//! The arm: mechanism, friction, and the paper's list of unknowns in the model's terms.

use std::sync::Arc;

use dynid::elements::ElementPlan;
use dynid::model::element::{Coulomb, JointElement, Offset, Viscous};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, Mechanism, MotionBlock, RobotModel};
use dynid::nominal::nominal_parameters;
use dynid::{Robot, RobotOptions};

use super::settings::Settings;
use crate::StudyError;

/// Joints that are identified.
pub(super) const JOINTS: usize = 3;
/// Base inertial parameters among the unknowns.
pub(super) const INERTIAL: usize = 15;

const SETTINGS: &str = "er16/settings.toml";

/// Where an unknown of the paper's list is found in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// Base parameter of this index.
    Base(usize),
    /// Shape parameter of this index.
    Shape(usize),
}

/// The arm with the friction of the paper, and the truth.
#[derive(Debug)]
pub(super) struct Arm {
    pub(super) mechanism: Mechanism,
    pub(super) model: Arc<RobotModel>,
    /// All linear parameters of the model.
    pub(super) linear: Vec<f64>,
    /// Shape parameters of the model.
    pub(super) shape: Vec<f64>,
    pub(super) base: BaseParameters,
    /// The paper's unknowns, in its order.
    pub(super) places: Vec<Place>,
}

impl Arm {
    pub(super) fn new(settings: &Settings) -> Result<Self, StudyError> {
        let robot = Robot::parse(
            include_str!("../../../../robots/er16.toml"),
            "robots/er16.toml".as_ref(),
            &RobotOptions::default(),
        )?;
        let mechanism = robot.mechanism.clone();
        let plan = ElementPlan::new(&mechanism, &robot.elements, None, |_| true)?;
        let model = RobotModel::new(mechanism.clone(), plan.build(&mechanism)?);
        let linear = nominal_parameters(&model, &plan, &Default::default())?;
        let shape = model.parameters().shape_start();
        let base = BaseParameters::of(&model, &mechanism, &shape, &BaseSettings::default());
        let places = settings
            .unknowns
            .iter()
            .map(|unknown| {
                let missing = || StudyError::Data {
                    file: SETTINGS,
                    message: format!("no parameter `{}` among the model's", unknown.name),
                };
                let table = model.parameters();
                let symbols = base.kept.iter().map(|c| table.linear[*c].symbol.as_str());
                let at = symbols.into_iter().position(|s| s == unknown.name).map(Place::Base);
                let shape_name = |k: usize| {
                    let (symbol, joint) = unknown.name.split_at(unknown.name.len() - 1);
                    table.shape[k].name == format!("j{joint}.{symbol}")
                };
                let or_shape = || (0..table.shape.len()).find(|k| shape_name(*k)).map(Place::Shape);
                at.or_else(or_shape).ok_or_else(missing)
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Arm { model: Arc::new(model), linear, shape, base, places, mechanism })
    }

    /// Returns the arm with linear friction: Coulomb and viscous, with an offset or without.
    pub(super) fn with_linear_friction(&self, offset: bool) -> RobotModel {
        let mut elements: Vec<Box<dyn JointElement>> = Vec::new();
        for rate in 0..JOINTS {
            if offset {
                elements.push(Box::new(Offset { rate }));
            }
            elements.push(Box::new(Coulomb { rate }));
            elements.push(Box::new(Viscous { rate }));
        }
        RobotModel::new(self.mechanism.clone(), elements)
    }

    /// Values of the paper's unknowns from base values and shape.
    pub(super) fn unknowns(&self, base: &[f64], shape: &[f64]) -> Vec<f64> {
        let value = |place: &Place| match *place {
            Place::Base(k) => base[k],
            Place::Shape(k) => shape[k],
        };
        self.places.iter().map(value).collect()
    }

    /// Base values and shape from the paper's unknowns.
    pub(super) fn split(&self, unknowns: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut base = vec![0.0; self.base.len()];
        let mut shape = vec![0.0; self.shape.len()];
        for (place, value) in self.places.iter().zip(unknowns) {
            match *place {
                Place::Base(k) => base[k] = *value,
                Place::Shape(k) => shape[k] = *value,
            }
        }
        (base, shape)
    }

    /// Efforts of the paper's unknowns over a block: joint `j`, sample `s` at `[j * samples + s]`.
    pub(super) fn efforts(&self, motion: &MotionBlock<'_>, unknowns: &[f64]) -> Vec<f64> {
        let (base, shape) = self.split(unknowns);
        let linear = self.base.expanded(&base);
        let mut effort = vec![0.0; JOINTS * motion.samples];
        self.model.efforts(motion, &shape, &linear, motion.samples, &mut effort);
        effort
    }
}
