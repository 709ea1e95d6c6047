//! Everything that a fit depends on: robot, elements, model, structure, logs, settings.

use std::sync::Arc;

use dynid_estimate::separable::SeparableSettings;
use dynid_model::element::scale_name;
use dynid_model::{EffortModel, RobotModel};
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, PreparedLog, Stage, condition, refine};

use crate::Error;
use crate::elements::ElementPlan;
use crate::robot::Robot;
use crate::settings::{Route, Settings};
use crate::structure::Structure;
use crate::training_log::TrainingLog;

/// Everything that a fit depends on.
#[derive(Debug)]
pub struct Problem {
    /// The robot; joints that are not logged are locked.
    pub robot: Robot,
    /// Elements per joint; a fit adds the shapes of friction that it finds.
    pub plan: ElementPlan,
    /// The effort model; a fit with shape parameters linearises it about the values found.
    pub model: RobotModel,
    /// What is known of the model before its fit.
    pub structure: Structure,
    /// Training logs.
    pub logs: Arc<[PreparedLog]>,
    /// What has to be known of them beside their signals.
    pub training: Vec<TrainingLog>,
    /// Settings.
    pub settings: Settings,
}

impl Problem {
    /// Settings of the conditioning.
    pub fn conditioning_settings(&self) -> ConditioningSettings {
        self.settings.conditioning_settings()
    }

    /// The same problem on other logs, or parts of them, with other settings: structure and model are formed anew.
    ///
    /// # Errors
    /// Settings that do not fit the model.
    pub fn on(&self, logs: Arc<[PreparedLog]>, settings: Settings) -> Result<Problem, Error> {
        let (robot, plan) = (self.robot.clone(), self.plan.clone());
        let model = plan.tied_model(&robot.mechanism)?;
        let structure = Structure::of(&settings, &robot, &model, &plan, &logs)?;
        Ok(Problem { robot, plan, model, structure, logs, training: self.training.clone(), settings })
    }

    /// Names of the training logs.
    pub fn labels(&self) -> Vec<String> {
        self.training.iter().map(|log| log.label.clone()).collect()
    }

    /// Forms the model of the plan and its structure.
    pub(super) fn rebuild(&mut self) -> Result<(), Error> {
        self.model = self.plan.tied_model(&self.robot.mechanism)?;
        self.restructure()
    }

    /// Forms the structure of the model.
    pub(super) fn restructure(&mut self) -> Result<(), Error> {
        self.structure = Structure::of(&self.settings, &self.robot, &self.model, &self.plan, &self.logs)?;
        Ok(())
    }

    /// Chooses kernel, mask and delay; `None` on the textbook route.
    ///
    /// Where some logs have a factor on friction, they are conditioned with the factors equal to 1, the factors are fitted, and everything is
    /// chosen again beside these: what is left of a log's friction would otherwise count as noise, and the kernel and the shapes of friction
    /// be chosen too coarse. The plan starts later searches from the factors found. So it is with friction that follows reactions, and with journals in bearings: they are
    /// conditioned with the loads of the robot file first, then with those that a first fit finds.
    ///
    /// # Errors
    /// [`Error::Conditioning`], [`Error::Shapes`].
    pub fn condition(&mut self, progress: &mut dyn FnMut(Stage)) -> Result<Option<Conditioning>, Error> {
        if self.settings.conditioning.route == Route::Textbook {
            return Ok(None);
        }
        let settings = self.conditioning_settings();
        let kept = &self.structure.base.kept;
        let start = self.model.parameters().shape_start();
        let choices = condition(&self.model, &start, kept, &self.logs, &settings, progress)?;
        if self.plan.follows_loads() {
            self.plan.load_values = self.first_loads(&choices)?;
            self.rebuild()?;
            let (start, kept) = (self.model.parameters().shape_start(), &self.structure.base.kept);
            return Ok(Some(condition(&self.model, &start, kept, &self.logs, &settings, progress)?));
        }
        let scaled = self.plan.log_terms.scaled();
        if scaled.is_empty() {
            return Ok(Some(choices));
        }
        let once = SeparableSettings { starts: 1, profile_points: 0, ..SeparableSettings::default() };
        let found = refine(&self.model, &start, kept, &self.logs, &choices, &settings, &once)?;
        for (log, _) in scaled {
            let name = scale_name(&log);
            let place = self.model.parameters().shape.iter().position(|s| s.name == name);
            self.plan.log_terms.set_scale(&log, place.map_or(1.0, |k| found.shape[k]));
        }
        self.model = self.plan.tied_model(&self.robot.mechanism)?;
        let start = self.model.parameters().shape_start();
        Ok(Some(condition(&self.model, &start, kept, &self.logs, &settings, progress)?))
    }
}
