//! From a problem to values: shapes, linear fit, covariance, bodies that can exist.

use dynid_model::RobotModel;
use dynid_rows::conditioning::{Conditioning, JointFriction, ReducedGroup};

use super::Step;
use super::shapes::{self, Before, Shaped};
use crate::Error;
use crate::closed_loop::{self, Loop, LoopFit, LoopRun};
use crate::consistency::{self, Consistent};
use crate::fitting::{self, Fitted, RowResiduals};
use crate::friction_power::{self, FrictionPower};
use crate::joint_cyclic::{JointCyclic, JointSlow};
use crate::load_rounds::LoadRounds;
use crate::problem::Problem;
use crate::settings::Settings;
use crate::shape::{self, ShapeFit};

/// What a fit found. The model, plan and structure that it ended with are those of its problem.
#[derive(Debug)]
pub struct ModelFit {
    /// `None` on the textbook route.
    pub conditioning: Option<Conditioning>,
    /// Shapes of friction per output.
    pub friction: Vec<JointFriction>,
    /// Cyclic efforts that joints took.
    pub cyclic: Vec<JointCyclic>,
    /// What the residuals of joints hold of slow functions of their positions.
    pub slow: Vec<JointSlow>,
    /// Shape parameters as found.
    pub shapes: Option<ShapeFit>,
    /// How the simulations went, for estimators that simulate the closed loop.
    pub simulations: Option<LoopRun>,
    pub(crate) residuals: RowResiduals,
    /// The fit in the base columns.
    pub fitted: Fitted,
    /// Rows of the measured motion, reduced.
    pub groups: Vec<ReducedGroup>,
    /// Standard parameters.
    pub consistent: Consistent,
    /// What friction had to obey.
    pub(crate) power: FrictionPower,
    /// How the loads of friction came to rest, where friction follows reactions.
    pub loads: Option<LoadRounds>,
}

impl Problem {
    /// One fit with the loads of the plan.
    ///
    /// # Errors
    /// As [`Problem::fit`].
    pub(super) fn fit_at_loads(
        mut self,
        conditioning: Option<Conditioning>,
        before: Before,
        progress: &mut dyn FnMut(Step),
    ) -> Result<(Problem, ModelFit), Error> {
        let Shaped { conditioning, friction, found: shapes } =
            shapes::search(&mut self, conditioning, before, progress)?;
        let state_hz = state_hz(&self.settings, conditioning.as_ref());
        let settings = self.conditioning_settings();
        let power = friction_power::limits(&self.model, &self.plan, &self.logs, state_hz, &settings)?;
        self.model = power.free(self.model);
        self.structure.bounds.extend(power.bounds.iter().cloned());
        self.structure.bounds.extend(friction_power::falls(&self.model, &friction));
        progress(Step::Fit);
        let base = self.structure.base.len();
        let source = fitting::rows(&self, conditioning.as_ref())?;
        let (fit, groups) = fitting::fit(&self.settings, base, &self.structure.method, &*source)?;
        let LoopFit { estimate, run, groups: simulated, residuals } =
            match self.settings.estimator.method.simulates() {
                true => {
                    progress(Step::Instruments);
                    let closed = Loop {
                        problem: &self,
                        shapes: shapes.as_ref(),
                        conditioning: conditioning.as_ref(),
                        power: &power,
                    };
                    closed_loop::fit(&closed, fit)?
                }
                false => LoopFit::without_simulation(fit),
            };
        let measured = fitting::residuals(&*source, &estimate)?;
        drop(source);
        let fixed = self.settings.conditioning.block_s.is_some();
        let fitted =
            fitting::with_precision(estimate, residuals.as_ref().unwrap_or(&measured), &self.logs, fixed);
        progress(Step::Consistency);
        let consistent = consistency::consistent(&self, &fitted, simulated.as_ref().unwrap_or(&groups))?;
        let fit = ModelFit {
            conditioning,
            friction,
            cyclic: Vec::new(),
            slow: Vec::new(),
            shapes,
            simulations: run,
            residuals: measured,
            fitted,
            groups,
            consistent,
            power,
            loads: None,
        };
        Ok((self, fit))
    }
}

/// Cut-off of the states behind predictions, Hz.
pub(crate) fn state_hz(settings: &Settings, conditioning: Option<&Conditioning>) -> f64 {
    match conditioning {
        Some(c) => c.prediction_hz,
        None => settings.textbook_route().cutoff_hz,
    }
}

impl ModelFit {
    /// The nonlinear model and its linear parameters that the fit's values stand for; `None` if the model of its problem is not linearised.
    ///
    /// # Errors
    /// Fails as the plan of the problem does.
    pub fn unfolded(&self, problem: &Problem) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
        shape::nonlinear(&problem.plan, &problem.model, self.shapes.as_ref(), &self.consistent.values)
    }

    /// Values without constraints of the nonlinear model's linear parameters.
    pub(crate) fn unconstrained_values(&self, problem: &Problem) -> Vec<f64> {
        let values = &self.consistent.unconstrained;
        match &self.shapes {
            Some(found) => shape::unfold(&found.model, &problem.model, values).linear,
            None => values.clone(),
        }
    }

    /// [`ModelFit::unfolded`], of a linear model the model of the plan.
    pub(crate) fn nonlinear(&self, problem: &Problem) -> Result<(RobotModel, Vec<f64>), Error> {
        match self.unfolded(problem)? {
            Some(found) => Ok(found),
            None => Ok((problem.plan.model(problem.model.mechanism())?, self.consistent.values.clone())),
        }
    }
}
