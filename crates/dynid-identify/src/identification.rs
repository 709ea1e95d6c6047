//! An identified model, and what it can say of itself: values, predictions, agreement with logs.

use std::sync::Arc;

use dynid_estimate::consistent::Bound;
use dynid_estimate::elimination::Pruning;
use dynid_estimate::linear::LinearEstimate;
use dynid_estimate::whiteness::InBandWhiteness;
use dynid_factor::rank::numerical_rank;
use dynid_model::{BaseParameters, EffortModel, RobotModel};
use dynid_rows::conditioning::{Conditioning, ConditioningSettings, JointFriction, PreparedLog, predict};

use crate::Error;
use crate::agreement::{self, Agreement, Alignment};
use crate::caution::Caution;
use crate::check::CheckResult;
use crate::closed_loop::{Comparison, LoopRun};
use crate::consistency::Consistent;
use crate::effort_scale::{self, EffortScale, WeighedMass};
use crate::elements::ElementPlan;
use crate::estimate::LogFit;
use crate::finding::Finding;
use crate::fitting::Fitted;
use crate::friction_power::FrictionPower;
use crate::joint_cyclic::{JointCyclic, JointSlow};
use crate::joint_stiffness::{JointStiffness, StiffJoint};
use crate::journal_doubt::JournalSeen;
use crate::load_rounds::LoadRounds;
use crate::log::LogSource;
use crate::log_agreement::LogAgreement;
use crate::overlap::Overlaps;
use crate::own_delay::OwnDelay;
use crate::prior::Prior;
use crate::robot::Robot;
use crate::searches::Searches;
use crate::settings::{LogSettings, Settings};
use crate::shape::{self, ShapeFit};
use crate::tie_test::TieTest;
use crate::trained_log::{RowFit, TrainedLog};
use crate::trust::Trust;

/// Time blocks that standard deviations want.
const BLOCKS_WANTED: f64 = 20.0;

/// An identified model with everything that was found on the way.
#[derive(Debug)]
pub struct Identification {
    /// The robot; joints that are not logged are locked.
    pub robot: Robot,
    /// Elements per joint.
    pub plan: ElementPlan,
    /// The effort model of the fit: with shape parameters, linearised about the values found.
    pub model: RobotModel,
    /// Shape parameters as found; `None` if the model has none or the route does not search them.
    pub shapes: Option<ShapeFit>,
    /// The nonlinear model with its linear parameters that the fit's parameters stand for, where it was linearised.
    pub nonlinear: Option<(RobotModel, Vec<f64>)>,
    /// The robot alone with its linear parameters, where the model has terms of single logs.
    pub alone: Option<(RobotModel, Vec<f64>)>,
    /// Base parameters of the model.
    pub base: BaseParameters,
    /// Training logs; empty where the fit was made from what was left of them.
    pub logs: Arc<[PreparedLog]>,
    /// What is known of every training log without its samples.
    pub trained: Vec<TrainedLog>,
    /// Validation logs.
    pub validation_logs: Vec<PreparedLog>,
    /// Name in parameters and settings of every training log.
    pub log_settings: Vec<(String, LogSettings)>,
    /// Where the logs come from, validation logs behind the training logs.
    pub sources: Vec<LogSource>,
    /// Stiffness of elastic joints by their deformation; empty without encoders on both sides of gears, and where sensors
    /// measure the load.
    pub stiffness: Vec<JointStiffness>,
    /// Elastic joints that were taken as stiff ones, since the deformation did not bear out the stiffness of the fit, or since that was asked for.
    pub stiff_joints: Vec<StiffJoint>,
    /// Choices of the compact route; `None` on the textbook route.
    pub conditioning: Option<Conditioning>,
    /// Per output: friction shapes chosen beside the elements asked for, and candidates that were not; empty where none
    /// were looked for.
    pub friction: Vec<JointFriction>,
    /// Cyclic efforts that the residuals of a first fit showed, beside the elements asked for.
    pub cyclic: Vec<JointCyclic>,
    /// What the residuals of joints hold of slow functions of their positions; empty on the textbook route and for joints that do not pass often enough.
    pub slow: Vec<JointSlow>,
    /// What is known about the parameters without logs.
    pub prior: Prior,
    /// The fit in the base columns.
    pub fitted: Fitted,
    /// Standard parameters, physically consistent unless told otherwise.
    pub consistent: Consistent,
    /// Per output: whether the model explains at least half of the effort, on every log in which the joint
    /// moves and on held-out folds.
    pub explained: Vec<bool>,
    /// How far each parameter can be trusted.
    pub trust: Trust,
    /// Values stated by robot file, in parameter order.
    pub stated: Vec<Option<f64>>,
    /// Per joint: residual of the widest kernel against what sensor noise explains.
    pub residual_ratio: Vec<Option<f64>>,
    /// Rows of the final fit.
    pub rows: usize,
    /// Per joint: RMS of the fit's own rows (filtered and thinned as the fit saw them), in the effort's unit.
    pub row_rms: Vec<Option<f64>>,
    /// State cut-off for predictions, Hz.
    pub state_hz: f64,
    /// Kernel (or filter) cut-off, Hz.
    pub kernel_hz: f64,
    /// Delay used, samples.
    pub delay_samples: f64,
    /// Sample rate of the training logs, Hz; the delay is not applied to logs of another rate.
    pub delay_rate_hz: f64,
    /// Agreement on the training logs; empty where the fit was made from what was left of them.
    pub training: Vec<Agreement>,
    /// Figures on the rows of the training logs, where these are all that is left of them; else empty.
    pub row_fits: Vec<RowFit>,
    /// What the identification that taught the recipe was in doubt of, where factors are solved; else empty.
    pub recipe_doubts: Vec<CheckResult>,
    /// Agreement on the validation logs.
    pub validation: Vec<Agreement>,
    /// Figures of the unconstrained parameters on the training logs, where they predict differently.
    pub training_unconstrained: Vec<LogFit>,
    /// Figures of the unconstrained parameters on the validation logs.
    pub validation_unconstrained: Vec<LogFit>,
    /// Per training log and output: whether the raw residuals are white inside the kernel's band.
    pub whiteness: Vec<Vec<Option<InBandWhiteness>>>,
    /// Models with fewer and fewer base parameters, and how well they do.
    pub pruning: Option<Pruning>,
    /// Whether the training logs agree in what the fit holds the same; `None` with one log, or where it could not be told.
    pub log_agreement: Option<LogAgreement>,
    /// Delays of single logs, taken off their efforts.
    pub own_delays: Vec<OwnDelay>,
    /// What was noticed on the way and is no check of its own.
    pub warnings: Vec<Caution>,
    /// What the pre-flight of the training logs found.
    pub findings: Vec<Finding>,
    /// Rows that logs share.
    pub overlaps: Overlaps,
    /// What speaks for the scale of the efforts.
    pub effort_scale: EffortScale,
    /// What friction had to obey.
    pub(crate) power: FrictionPower,
    /// What the consistent estimate had to meet.
    pub(crate) bounds: Vec<Bound>,
    /// Standard deviations that the prior leaves of the base parameters.
    pub(crate) base_scales: Vec<f64>,
    /// Per output, the effort that 99 % of the samples stay below.
    pub(crate) effort_sizes: Vec<f64>,
    /// Settings of the conditioning.
    pub conditioning_settings: ConditioningSettings,
    /// Settings of the identification.
    pub settings: Settings,
    /// How the simulations of the fit went; `None` for estimators that simulate nothing.
    pub simulations: Option<LoopRun>,
    /// Least squares against instruments; `None` if the configuration says nothing about the closed loop, or what was identified is not
    /// simulated in closed loop, which is then a warning.
    pub comparison: Option<Comparison>,
    /// How the loads of friction came to rest, where friction follows reactions.
    pub loads: Option<LoadRounds>,
    /// Whether the logs bear the ties out, where there are some.
    pub tie_test: Option<TieTest>,
    /// Searches over all parameters, where they were asked for.
    pub searches: Option<Searches>,
    /// Journals of joints with clearance over the training logs.
    pub(crate) journals: Vec<JournalSeen>,
}

impl Identification {
    /// Standard parameters of bodies that can exist (unless no consistency was asked for), in column order: what predictions
    /// use and what goes into robot files.
    pub fn values(&self) -> &[f64] {
        &self.consistent.values
    }

    /// Standard parameters without constraints: base values exactly as fitted, split as near as possible to the robot file.
    pub fn unconstrained_values(&self) -> &[f64] {
        &self.consistent.unconstrained
    }

    /// The linear fit in base columns.
    pub fn fit(&self) -> &LinearEstimate {
        &self.fitted.estimate
    }

    /// Condition number of the base columns that the logs excite, at unit length, without the columns that shape parameters have
    /// where the model was linearised: those say how a law bends, and stand close to the law itself by nature.
    pub fn condition_without_shapes(&self) -> f64 {
        let solution = &self.fit().solution;
        let table = &self.model.parameters().linear;
        let is_law = |k: &usize| shape::of_change(&table[self.base.kept[solution.kept[*k]]].name).is_none();
        let laws: Vec<usize> = (0..solution.kept.len()).filter(is_law).collect();
        match laws.len() == solution.kept.len() {
            true => solution.condition_scaled,
            false => numerical_rank(&solution.factor.select(&laws)).condition_scaled,
        }
    }

    /// Number of time blocks behind the standard deviations.
    pub fn blocks(&self) -> usize {
        self.fitted.estimate.blocks.len()
    }

    /// Predicts a log by given standard parameters and compares.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn agreement(&self, values: &[f64], log: &PreparedLog) -> Result<Agreement, Error> {
        let unfolded = self.unfolded(values)?;
        let (model, values) = unfolded.as_ref().map_or((&self.model, values), |(m, v)| (m, v));
        agreement::compare(model, values, log, &self.alignment(), &self.conditioning_settings)
    }

    /// [`Identification::agreement`] of [`Identification::values`], with what pictures show.
    pub(crate) fn drawn_agreement(&self, log: &PreparedLog) -> Result<Agreement, Error> {
        let (model, values) = self.identified_model();
        self.agreement(self.values(), log)?.draw(
            model,
            values,
            log,
            &self.alignment(),
            &self.conditioning_settings,
        )
    }

    pub(crate) fn alignment(&self) -> Alignment {
        Alignment {
            state_hz: self.state_hz,
            delay_samples: self.delay_samples,
            delay_rate_hz: self.delay_rate_hz,
            filter_hz: self.kernel_hz,
        }
    }

    /// The nonlinear model and its linear parameters that parameters of the fit stand for; `None` if the fit's model is not
    /// linearised.
    pub(crate) fn unfolded(&self, values: &[f64]) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
        shape::nonlinear(&self.plan, &self.model, self.shapes.as_ref(), values)
    }

    /// The identified model and its linear parameters: [`Identification::values`], or what they stand for where the fit's
    /// model is linearised.
    pub fn identified_model(&self) -> (&RobotModel, &[f64]) {
        self.nonlinear.as_ref().map_or((&self.model, self.values()), |(model, values)| (model, values))
    }

    /// Lead of the effort that predictions of a log take into account, samples: that of the fit at the same rate, else 0.
    pub fn delay_on(&self, log: &PreparedLog) -> f64 {
        agreement::lead(log.rate_hz, self.delay_samples, self.delay_rate_hz)
    }

    /// Predicted effort on a prepared log, per output.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn predict(&self, log: &PreparedLog) -> Result<Vec<Vec<f64>>, Error> {
        let (model, values) = self.identified_model();
        let shape = model.parameters().shape_start();
        Ok(predict(
            model,
            &shape,
            values,
            log,
            self.state_hz,
            self.delay_samples,
            &self.conditioning_settings,
        )?)
    }

    /// What speaks for the scale of the efforts.
    pub(crate) fn scale_of_efforts(&self) -> Result<EffortScale, Error> {
        let weighed = effort_scale::mass_columns(&self.settings.known_mass, &self.model)?;
        let of = |(name, column, known): (String, usize, f64)| {
            let trust = &self.trust.parameters[column];
            WeighedMass { name, known, identified: trust.unconstrained, interval: trust.interval }
        };
        let masses = weighed.into_iter().map(of).collect();
        if self.logs.is_empty() {
            let (base, groups) = (&self.base, &self.fit().reduced);
            let by_file = effort_scale::by_robot_file_in_rows(base, self.values(), &self.prior, groups);
            return Ok(EffortScale::of(masses, self.settings.known_effort_scale, by_file));
        }
        let by_file = effort_scale::by_robot_file(
            &self.model,
            self.values(),
            &self.prior,
            &self.logs,
            self.state_hz,
            &self.conditioning_settings,
        )?;
        Ok(EffortScale::of(masses, self.settings.known_effort_scale, by_file))
    }

    /// Standard deviations of all base parameters: reported and white; `None` where a column was dropped.
    pub fn standard_deviations(&self) -> Vec<(Option<f64>, Option<f64>)> {
        let mut out = vec![(None, None); self.base.len()];
        for (k, c) in self.fit().solution.kept.iter().enumerate() {
            let white = self.fitted.white[(k, k)].max(0.0).sqrt();
            let reported = self.fitted.covariance()[(k, k)].max(0.0).sqrt();
            out[*c] = (Some(reported), Some(white));
        }
        out
    }

    /// Length of all training logs without what repeats in each, s.
    pub fn distinct_s(&self) -> f64 {
        self.trained.iter().map(TrainedLog::distinct_s).sum()
    }

    /// Time of other motion that logs lack for as many independent blocks as standard deviations want, s.
    pub fn lacking_s(&self) -> f64 {
        let wanted = BLOCKS_WANTED * self.fitted.block_length.seconds.max(self.fitted.block_s);
        Some(wanted - self.distinct_s())
            .filter(|lacking| lacking.is_finite())
            .map_or(0.0, |lacking| lacking.max(0.0))
    }

    /// Samples of all training logs.
    pub fn samples(&self) -> usize {
        self.trained.iter().map(|log| log.samples).sum()
    }
}
