//! Design of excitation trajectories for the condition number of a model's base columns.

use dynid::design::DesignError;
use std::f64::consts::PI;
use std::sync::Arc;

use dynid::excitation::constraint::{CartesianLimits, EffortLimits, FramePoint, Region};
use dynid::excitation::criterion::{Criterion, Measure};
use dynid::excitation::{
    DEFAULT_SAMPLES_PER_HARMONIC, DEFAULT_SIGN_WIDTH, Design, Problem, RobotExcitation, StartConditions,
};
use dynid::model::{BaseParameters, BaseSettings, EffortModel, Mechanism, RobotModel};
use dynid::motion::trajectory::MotionLimits;

use crate::StudyError;

const HARMONICS: usize = 5;

/// What a trajectory of five harmonics has to keep to, besides the limits of positions, velocities and efforts that the robot
/// file states.
#[derive(Debug)]
pub(crate) struct Excitation<'a> {
    pub(crate) mechanism: &'a Mechanism,
    /// Angular frequency of the period, rad/s.
    pub(crate) base: f64,
    /// Samples of the period on which the condition is evaluated.
    pub(crate) samples: usize,
    /// Per joint, rad/s².
    pub(crate) acceleration: &'a [f64],
    /// Where points of links have to stay.
    pub(crate) regions: &'a [(FramePoint, Region)],
    /// Predicts the efforts that are limited: model, shape and linear parameters.
    pub(crate) nominal: (Arc<RobotModel>, Vec<f64>, Vec<f64>),
}

impl Excitation<'_> {
    /// The search for a trajectory that shows the columns of `model`.
    pub(crate) fn problem(self, model: RobotModel) -> Result<Problem, StudyError> {
        let (mechanism, model) = (self.mechanism, Arc::new(model));
        let base = BaseParameters::of(model.as_ref(), mechanism, &[], &BaseSettings::default());
        let limits = mechanism.bodies().iter().zip(self.acceleration).map(|(body, acceleration)| {
            let stated = body.joint.limits;
            MotionLimits {
                position: stated.position.unwrap_or((-PI, PI)),
                velocity: stated.velocity.unwrap_or(f64::INFINITY),
                acceleration: *acceleration,
                jerk: f64::INFINITY,
            }
        });
        let torque: Vec<Option<f64>> = mechanism.bodies().iter().map(|b| b.joint.limits.effort).collect();
        let (nominal, shape, linear) = self.nominal;
        Ok(Problem {
            coordinates: mechanism.rate_names(),
            limits: limits.collect(),
            constraints: vec![
                Box::new(EffortLimits::new(nominal, shape, linear, &torque).map_err(DesignError::from)?),
                Box::new(CartesianLimits::new(mechanism, self.regions).map_err(DesignError::from)?),
            ],
            base: self.base,
            harmonics: HARMONICS,
            start: StartConditions::default(),
            criterion: Criterion::raw(Measure::Condition),
            output_weights: vec![1.0; model.outputs().len()],
            effective_samples: self.samples as f64,
            prior: None,
            sign_width: DEFAULT_SIGN_WIDTH,
            samples: HARMONICS * DEFAULT_SAMPLES_PER_HARMONIC,
            model: Box::new(RobotExcitation::new(model, Vec::new(), &base, None)),
        })
    }
}

/// Condition of every start that ended within the limits, the best first.
pub(crate) fn conditions_of_starts(design: &Design) -> Vec<f64> {
    let feasible = design.starts.iter().filter(|s| s.is_feasible());
    let mut out: Vec<f64> = feasible.filter_map(|s| s.criterion.map(f64::exp)).collect();
    out.sort_by(f64::total_cmp);
    out
}
