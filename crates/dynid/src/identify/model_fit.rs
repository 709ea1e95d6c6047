//! From a model and conditioned logs to values: shapes, linear fit, covariance, bodies that can exist.

use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{
    Conditioning, ConditioningSettings, JointFriction, PreparedLog, ReducedGroup,
};

use super::Step;
use super::shapes::{self, Shaped};
use super::structure::Structure;
use crate::Error;
use crate::config::{Config, Method};
use crate::consistency::{self, Consistent};
use crate::elements::ElementPlan;
use crate::fitting::{self, Fitted, RowResiduals};
use crate::friction_power::{self, FrictionPower};
use crate::instruments::{self, InstrumentRun};
use crate::robot::Robot;
use crate::shape::{self, ShapeFit};

/// A fitted model.
pub(crate) struct ModelFit {
    /// Linear in all its parameters, unless no shape parameters were searched.
    pub(crate) model: RobotModel,
    pub(crate) structure: Structure,
    /// `None` on the textbook route.
    pub(crate) conditioning: Option<Conditioning>,
    /// Shapes of friction per output.
    pub(crate) friction: Vec<JointFriction>,
    /// Shape parameters as found.
    pub(crate) shapes: Option<ShapeFit>,
    /// How instruments came about, for the estimator that uses them.
    pub(crate) instruments: Option<InstrumentRun>,
    pub(crate) residuals: RowResiduals,
    pub(crate) fitted: Fitted,
    pub(crate) groups: Vec<ReducedGroup>,
    pub(crate) consistent: Consistent,
    /// What friction had to obey.
    pub(crate) power: FrictionPower,
}

/// Fits a model to logs as a configuration asks for.
///
/// # Errors
/// Settings that do not fit the model, too few rows, what the estimators refuse.
#[expect(clippy::too_many_arguments, reason = "the arguments are all that a fit depends on")]
pub(crate) fn fit(
    config: &Config,
    robot: &Robot,
    plan: &mut ElementPlan,
    model: (RobotModel, Structure),
    logs: &[PreparedLog],
    conditioning: Option<Conditioning>,
    settings: &ConditioningSettings,
    progress: &mut dyn FnMut(Step),
) -> Result<ModelFit, Error> {
    let Shaped { model, mut structure, conditioning, friction, found: shapes } =
        shapes::search(config, model, plan, logs, conditioning, settings, progress)?;
    let state_hz = state_hz(config, conditioning.as_ref());
    let power = friction_power::limits(&model, plan, logs, state_hz, settings)?;
    let model = power.free(model);
    structure.bounds.extend(power.bounds.iter().cloned());
    structure.bounds.extend(friction_power::falls(&model, &friction));
    let shape = model.parameters().shape_start();
    progress(Step::Fit);
    let Structure { base, prior, regrouping, bounds, method, .. } = &structure;
    let source = fitting::rows(config, &model, &shape, &base.kept, logs, conditioning.as_ref(), settings)?;
    let (fit, groups) = fitting::fit(config, base.len(), method, &*source)?;
    let (fit, instruments) = match config.estimator.method {
        Method::Iv => {
            let parts = instruments::Parts {
                robot,
                plan,
                model: &model,
                shapes: shapes.as_ref(),
                base,
                prior,
                logs,
                conditioning: conditioning.as_ref(),
                settings,
                power: &power,
            };
            progress(Step::Instruments);
            let (fit, run) = instruments::fit(config, &parts, fit)?;
            (fit, Some(run))
        }
        _ => (fit, None),
    };
    let residuals = fitting::residuals(&*source, &fit)?;
    drop(source);
    let fitted = fitting::with_precision(fit, &residuals, logs, config.conditioning.block_s.is_some());
    progress(Step::Consistency);
    let consistent =
        consistency::consistent(config, &model, base, regrouping, prior, bounds, &fitted, &groups)?;
    Ok(ModelFit {
        model,
        structure,
        conditioning,
        friction,
        shapes,
        instruments,
        residuals,
        fitted,
        groups,
        consistent,
        power,
    })
}

/// Cut-off of the states behind predictions, Hz.
pub(crate) fn state_hz(config: &Config, conditioning: Option<&Conditioning>) -> f64 {
    match conditioning {
        Some(c) => c.state_hz.iter().copied().fold(f64::INFINITY, f64::min),
        None => config.textbook_route().cutoff_hz,
    }
}

impl ModelFit {
    /// The nonlinear model and its linear parameters that the fit's values stand for; `None` if the fit's model is not
    /// linearised.
    ///
    /// # Errors
    /// Fails as the plan of the fit does.
    pub(crate) fn unfolded(&self, plan: &ElementPlan) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
        let Some(found) = &self.shapes else { return Ok(None) };
        let unfolded = shape::unfold(&found.model, &self.model, &self.consistent.values);
        let model = plan.model(self.model.mechanism())?;
        Ok(Some((model.with_shape(&unfolded.shape), unfolded.linear)))
    }
}
