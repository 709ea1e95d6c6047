//! What is known of a model before its fit: base parameters, prior, bounds, estimator.

use dynid_estimate::consistent::Bound;
use dynid_estimate::identifiability::VisibleSpace;
use dynid_estimate::linear::LinearMethod;
use dynid_linalg::Mat;
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RobotModel};
use dynid_rows::conditioning::PreparedLog;

use crate::elements::ElementPlan;
use crate::prior::{self, Prior};
use crate::robot::Robot;
use crate::settings::Settings;
use crate::{Error, advice, bounds, linear_method};

/// What is known of a model before its fit.
#[derive(Debug)]
pub struct Structure {
    /// Base parameters.
    pub base: BaseParameters,
    /// Shape parameters of the model where it starts.
    pub shape: Vec<f64>,
    /// Values stated by robot file, in parameter order.
    pub stated: Vec<Option<f64>>,
    /// Per output, the effort that 99 % of the samples of all logs stay below, N m or N.
    pub effort_sizes: Vec<f64>,
    /// What is known about the parameters without logs.
    pub prior: Prior,
    /// Base parameters from standard ones, `K` in `β = K x`.
    pub regrouping: Mat,
    /// What any motion of the robot can show of the standard parameters.
    pub space: VisibleSpace,
    /// Bounds that the consistent estimate must meet.
    pub bounds: Vec<Bound>,
    /// The linear estimator.
    pub method: LinearMethod,
}

impl Structure {
    pub(crate) fn of(
        settings: &Settings,
        robot: &Robot,
        model: &RobotModel,
        plan: &ElementPlan,
        logs: &[PreparedLog],
    ) -> Result<Self, Error> {
        let stated = stated_values(model, plan);
        let bounds = bounds::rows(&settings.bound, model)?;
        Self::known(settings, robot, model, &stated, &effort_sizes(logs), bounds)
    }

    /// The structure where values of the robot file, sizes of the efforts and bounds are known.
    pub(crate) fn known(
        settings: &Settings,
        robot: &Robot,
        model: &RobotModel,
        stated: &[Option<f64>],
        effort_sizes: &[f64],
        bounds: Vec<Bound>,
    ) -> Result<Self, Error> {
        let shape = model.parameters().shape_start();
        let base_settings = BaseSettings {
            seed: settings.seed.unwrap_or(1),
            preferred: preferred_columns(&settings.preferred, model)?,
            ..BaseSettings::default()
        };
        let base = BaseParameters::of_model(model, &shape, &base_settings);
        if base.is_empty() {
            return Err(Error::Unsupported("no parameter of this robot acts on any effort".to_owned()));
        }
        let mut prior = prior::of(model, stated, effort_sizes, &robot.path.display().to_string())?;
        model.complete(&mut prior.values);
        let regrouping = advice::regrouping(&base);
        let space = VisibleSpace::new(&regrouping, &prior.std);
        let method = linear_method::method(settings, model, &base, &prior, &space)?;
        let (stated, effort_sizes) = (stated.to_vec(), effort_sizes.to_vec());
        Ok(Structure { base, shape, stated, effort_sizes, prior, regrouping, space, bounds, method })
    }
}

/// Columns to keep as base parameters where there is a choice.
pub(crate) fn preferred_columns(preferred: &[String], model: &RobotModel) -> Result<Vec<usize>, Error> {
    preferred
        .iter()
        .map(|name| {
            let by_symbol = || model.parameters().linear.iter().position(|p| p.symbol == *name);
            model.parameters().column(name).or_else(by_symbol).ok_or_else(|| Error::Setting {
                name: "preferred".to_owned(),
                expected: "names of parameters such as `link2.Izz` or `Izz2`".to_owned(),
                found: name.clone(),
            })
        })
        .collect()
}

/// What the robot file states: link inertias, element values.
pub fn stated_values(model: &RobotModel, plan: &ElementPlan) -> Vec<Option<f64>> {
    let table = model.parameters();
    let mut stated: Vec<Option<f64>> = table.linear.iter().map(|p| p.prior).collect();
    for (name, value) in plan.stated_values() {
        if let Some(column) = table.column(&name) {
            stated[column] = Some(value);
        }
    }
    stated
}

/// Per output, the effort that 99 % of the samples of all logs stay below.
pub fn effort_sizes(logs: &[PreparedLog]) -> Vec<f64> {
    let outputs = logs.first().map_or(0, |l| l.effort.len());
    (0..outputs)
        .map(|j| {
            let mut sizes: Vec<f64> = logs.iter().flat_map(|l| l.effort[j].iter().map(|e| e.abs())).collect();
            let last = sizes.len().saturating_sub(1);
            if sizes.is_empty() {
                return 0.0;
            }
            *sizes.select_nth_unstable_by(last * 99 / 100, f64::total_cmp).1
        })
        .collect()
}
