//! The main job: from a robot file and logs to an identified model.

mod alone;
mod effect;
mod elastic;
mod figures;
mod friction;
pub(crate) mod known;
mod model_fit;
mod own_delay;
mod own_scale;
mod shapes;
mod structure;

use dynid_estimate::conditioning::{
    Conditioning, ConditioningSettings, JointFriction, PreparedLog, ReducedGroup, Stage, predict,
};
use dynid_estimate::elimination::{PruneSettings, Pruning, prune};
use dynid_estimate::linear::LinearEstimate;
use dynid_estimate::rank::numerical_rank;
use dynid_estimate::whiteness::InBandWhiteness;
use dynid_io::{ReadingNote, TrajectoryFile};
use dynid_model::element::scale_name;
use dynid_model::{BaseParameters, EffortModel, RobotModel};
use dynid_motion::Log;

use crate::Error;
use crate::agreement::{self, Agreement, Alignment};
use crate::caution::{self, Caution};
use crate::check::{self, Finding, Severity};
use crate::commands::RunFiles;
use crate::config::{Config, LogConfig, Preflight, Route};
use crate::consistency::Consistent;
use crate::effort_scale::{self, EffortScale, WeighedMass};
use crate::elements::ElementPlan;
use crate::estimate::{ExportedRecord, InputRecord, LogFit, ReadingRecord};
use crate::export::FileModels;
use crate::fitting::Fitted;
use crate::friction_power::FrictionPower;
use crate::instruments::{self, Comparison, InstrumentRun};
use crate::log_agreement::{self, LogAgreement};
use crate::log_terms::LogTerms;
use crate::logs::{self, LoadedLog};
use crate::overlap::Overlaps;
use crate::passivity::SPEED_SPAN_S;
use crate::prior::Prior;
use crate::result::short_name;
use crate::robot::{Robot, RobotOptions, refuse_internal_load};
use crate::shape::{self, ShapeFit};
use crate::stiffness::{self, JointStiffness};
use crate::trust::{Evidence, Trust};
use crate::verdict::CheckName;
pub(crate) use elastic::REMEDY as SPRING_REMEDY;
pub(crate) use model_fit::{ModelFit, fit as fit_model};
pub use own_delay::OwnDelay;
pub(crate) use own_scale::conditioned;
pub(crate) use structure::Structure;
pub(crate) use structure::{effort_sizes, stated_values};

/// What is being worked on, for progress displays.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Reading a file.
    Read(String),
    /// Pre-flight of the logs.
    Preflight,
    /// Structural analysis.
    Structure,
    /// A step of the conditioning.
    Conditioning(Stage),
    /// Searching shape parameters.
    Shapes,
    /// Final fit with its covariance.
    Fit,
    /// Simulations of the closed loop for instruments.
    Instruments,
    /// Physically consistent standard parameters.
    Consistency,
    /// Verdicts and motions that would help.
    Trust,
    /// Predicting a log.
    Validate(String),
}

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
    /// Training logs.
    pub logs: Vec<PreparedLog>,
    /// How their columns were understood.
    pub columns: Vec<Vec<(String, String)>>,
    /// Per training log, how the file was read where that was found out.
    pub found_out: Vec<Vec<ReadingNote>>,
    /// Files as they were read.
    pub inputs: Vec<InputRecord>,
    /// Files as commands name them.
    pub files: RunFiles,
    /// How logs were read.
    pub(crate) reading: ReadingRecord,
    /// Stiffness of elastic joints by their deformation; empty without encoders on both sides of gears, and where sensors
    /// measure the load.
    pub stiffness: Vec<JointStiffness>,
    /// Choices of the compact route; `None` on the textbook route.
    pub conditioning: Option<Conditioning>,
    /// Per output: friction shapes chosen beside the elements asked for, and candidates that were not; empty where none
    /// were looked for.
    pub friction: Vec<JointFriction>,
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
    /// Agreement on the training logs.
    pub training: Vec<Agreement>,
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
    /// Robot files beside the identified model.
    pub exported: ExportedRecord,
    /// What was noticed on the way and is no check of its own.
    pub warnings: Vec<Caution>,
    /// Whether the training logs were examined before.
    pub preflight: bool,
    /// What the pre-flight of the training logs found.
    pub findings: Vec<Finding>,
    /// Rows that logs share.
    pub overlaps: Overlaps,
    /// What speaks for the scale of the efforts.
    pub effort_scale: EffortScale,
    /// What friction had to obey.
    pub(crate) power: FrictionPower,
    /// Settings of the conditioning.
    pub settings: ConditioningSettings,
    /// How the instruments of the fit came about; `None` for other estimators.
    pub instruments: Option<InstrumentRun>,
    /// Least squares against instruments; `None` if the configuration says nothing about the closed loop, or what was identified is not
    /// simulated in closed loop, which is then a warning.
    pub comparison: Option<Comparison>,
}

/// Reads robot and logs, conditions, fits, validates.
///
/// Elastic joints without sensors of their load, whose stiffness in the fit is not borne out by the deformation that their encoders show,
/// are taken as stiff ones: the result is that of [`Identification::stiffness`] beside a model of stiff joints.
///
/// # Errors
/// [`Error`]: bad input. A rank-deficient log is a status of the result, not an error.
pub fn identify(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<Identification, Error> {
    config.demand_inputs()?;
    config.check_effect()?;
    config.check()?;
    progress(Step::Read(config.robot.display().to_string()));
    let robot = load_robot(config)?;
    let mut found = run(config, robot, progress)?;
    let stiffness = stiffness::of(&found)?;
    if stiffness.iter().all(JointStiffness::is_borne_out) {
        found.stiffness = stiffness;
        return Ok(found);
    }
    let doubts = elastic::warnings(&found.model, &found.logs);
    let elastic = load_robot(config)?;
    let stiff = stiffness::stiff_config(config, &elastic)?;
    let mut found = run(&stiff, stiffness::stiff_robot(&elastic)?, progress)?;
    found.warnings.extend(doubts);
    let message = format!(
        "the deformation does not bear out the stiffness that rows of links and motors give: joints are taken as stiff, read at their \
         motors, and their stiffness is that of the deformation: {}",
        stiffness.iter().map(JointStiffness::words).collect::<Vec<_>>().join("; ")
    );
    found.warnings.push(Caution::warn(caution::SPRING, message, elastic::REMEDY));
    found.stiffness = stiffness;
    Ok(found)
}

/// One run with a robot as it was read.
fn run(config: &Config, robot: Robot, progress: &mut dyn FnMut(Step)) -> Result<Identification, Error> {
    let settings = config.conditioning_settings();
    let reference_trajectory = config.instruments.as_ref().and_then(|table| table.trajectory.as_ref());
    let reference_trajectory = reference_trajectory.map(TrajectoryFile::read_source).transpose()?;
    let reference_trajectory = reference_trajectory.map(|(_, source)| InputRecord::of("trajectory", &source));
    let Opened {
        robot,
        read,
        validation,
        mut plan,
        model,
        logs: prepared,
        structure,
        own_delays,
        findings,
        overlaps,
    } = open_robot(config, robot, progress)?;
    let (model, conditioning) = match config.conditioning.route {
        Route::Compact => {
            let mut stages = |stage| progress(Step::Conditioning(stage));
            let (model, found) =
                conditioned(model, &structure, &mut plan, &prepared, &settings, &mut stages)?;
            (model, Some(found))
        }
        Route::Textbook => (model, None),
    };
    let mut warnings = robot.cautions(&structure.prior);
    warnings.extend(robot.clearance_warnings().map(|message| {
        let remedy = "`dynid clearance ROBOT dynid-out/estimate.json --log LOG`, with your files, tells the gap and its friction from the effort";
        Caution::warn(caution::CLEARANCE, message, remedy)
    }));
    warnings.extend(plan.alike(&robot.mechanism).iter().map(|pair| {
        let remedy = format!(
            "leave one of them out: `{} = [..]` under `[elements.joint]` lists those to keep",
            pair.joint
        );
        Caution::warn(caution::ELEMENTS, pair.to_string(), remedy)
    }));
    let ModelFit {
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
    } = fit_model(
        config,
        &robot,
        &mut plan,
        (model, structure),
        &prepared,
        conditioning,
        &settings,
        progress,
    )?;
    warnings.extend(effect::warnings(config, shapes.is_some()));
    let Structure { base, stated, prior, regrouping, space, .. } = structure;
    let state_hz = model_fit::state_hz(config, conditioning.as_ref());
    let (kernel_hz, delay_samples) = match &conditioning {
        Some(c) => (c.kernel_hz, c.delay.samples),
        None => (state_hz, 0.0),
    };
    let row_rms = figures::row_rms(&groups, &fitted.estimate.x, base.len());
    let residual_ratio = figures::residual_ratios(&groups, &fitted.estimate, &prepared, kernel_hz);
    warnings.extend(findings.iter().filter_map(Finding::caution));
    warnings.extend(prior.warnings.iter().map(|message| {
        let remedy = "state mass, centre of mass and inertia of the link in the robot file: `<inertial>` in a URDF, `mass`, `com` and \
                      `inertia_com = [xx, xy, xz, yy, yz, zz]` in TOML";
        Caution::warn(caution::ROBOT_FILE, message, remedy)
    }));
    let of_reading = read.iter().flat_map(|log| log.warnings.iter().cloned());
    let of_reading = of_reading.chain(validation.iter().flat_map(LoadedLog::warnings));
    warnings.extend(of_reading.map(|message| {
        let remedy = format!(
            "`{} --report check.html` draws the signals as they were read; columns and units are stated under `[columns]`",
            RunFiles::of(config).check()
        );
        Caution::warn(caution::LOG, message, remedy)
    }));
    warnings.extend(log_warnings(&model, &prepared));
    warnings.extend(elastic::warnings(&model, &prepared));
    warnings.extend(known::warnings(&plan, &robot.mechanism, &prepared));
    let scale = |log: &str| {
        shapes
            .as_ref()
            .and_then(|found| found.model.parameters().shape_value(&scale_name(log)))
            .unwrap_or(1.0)
    };
    let log_agreement = log_agreement::test(config, &model, &base, &fitted, &plan.log_terms, scale);
    warnings.extend(log_agreement.iter().flat_map(LogAgreement::warnings).map(|message| {
        let remedy = "give the log terms of its own in its `[[log]]`: `own = [\"offset\"]`, `own = [\"friction\"]`, \
                      `own = [\"friction_scale\"]` or `own = [\"delay\"]`; what it carries: `payload = \"tool\"`";
        Caution::warn(CheckName::AgreementOfLogs.name(), message, remedy)
    }));
    let rows: usize = groups.iter().map(ReducedGroup::rows).sum();
    let found_out: Vec<Vec<ReadingNote>> = read.iter().map(|log| log.reading.clone()).collect();
    let (understood, sources): (Vec<_>, Vec<_>) =
        read.into_iter().map(|log| (log.columns, log.inputs)).unzip();
    let mut inputs = InputRecord::of_robot(&robot);
    inputs.extend(sources.into_iter().flatten());
    let mut out = Identification {
        inputs,
        files: RunFiles::of(config),
        reading: ReadingRecord::of(config, &understood),
        stiffness: Vec::new(),
        plan,
        base,
        columns: understood,
        found_out,
        conditioning,
        friction,
        prior,
        fitted,
        consistent,
        trust: Trust::default(),
        explained: Vec::new(),
        stated,
        residual_ratio,
        rows,
        row_rms,
        state_hz,
        kernel_hz,
        delay_samples,
        delay_rate_hz: prepared[0].rate_hz,
        training: Vec::new(),
        validation: Vec::new(),
        training_unconstrained: Vec::new(),
        validation_unconstrained: Vec::new(),
        whiteness: Vec::new(),
        pruning: None,
        log_agreement,
        own_delays,
        warnings,
        preflight: config.preflight != Preflight::Off,
        findings,
        overlaps,
        effort_scale: EffortScale::default(),
        settings,
        power,
        logs: Vec::new(),
        robot,
        model,
        shapes,
        nonlinear: None,
        alone: None,
        exported: ExportedRecord::default(),
        instruments,
        comparison: None,
    };
    out.nonlinear = out.unfolded(out.values())?;
    out.alone = out.without_logs()?;
    let (files, projections) = FileModels::of(&out, &prepared)?;
    let (mut files_training, mut files_validation) = (Vec::new(), Vec::new());
    for (l, log) in prepared.iter().enumerate() {
        progress(Step::Validate(log.name.clone()));
        let agreement = out.drawn_agreement(log)?;
        out.whiteness.push(residuals.whiteness(l, &agreement, kernel_hz));
        if out.consistent.constrained() {
            let free = out.agreement(out.unconstrained_values(), log)?;
            out.training_unconstrained.push(crate::result::log_fit(&free));
        }
        files_training.extend(files.judge(&out, log, &agreement)?);
        out.training.push(agreement);
    }
    out.logs = prepared;
    if config.instruments.is_some() {
        progress(Step::Instruments);
        match instruments::compare(&out, config) {
            Ok(found) => out.comparison = Some(found),
            Err(Error::Unsupported(why)) => {
                let message = format!("least squares was not compared with instruments: {why}");
                out.warnings.push(Caution::warn(
                    CheckName::Instruments.name(),
                    message,
                    "leave out `[instruments]`",
                ));
            }
            Err(other) => return Err(other),
        }
    }
    for (log, mut loaded) in config.validation.iter().zip(validation) {
        progress(Step::Validate(log.path.display().to_string()));
        out.inputs.extend(loaded.inputs.drain(..).map(|input| match input.kind.as_str() {
            "log" => InputRecord { kind: "validation".to_owned(), ..input },
            _ => input,
        }));
        loaded.log = out.plan.log_terms.of_validation(loaded.log, log);
        let mut prepared = loaded.prepare(&out.model, &out.settings)?;
        if let Some(own) = out.own_delays.iter().find(|d| Some(&d.log) == log.like.as_ref()) {
            own.take_off(&mut prepared)?;
        }
        out.warnings.extend(known::cautions(known::logged_beyond(&out.plan.known, &prepared)));
        let agreement = out.drawn_agreement(&prepared)?;
        files_validation.extend(files.judge(&out, &prepared, &agreement)?);
        out.validation.push(agreement);
        if out.consistent.constrained() {
            let free = out.agreement(out.unconstrained_values(), &prepared)?;
            out.validation_unconstrained.push(crate::result::log_fit(&free));
        }
    }
    out.inputs.extend(out.plan.known_source.iter().map(|source| InputRecord::of("friction", source)));
    out.inputs.extend(reference_trajectory);
    out.exported = files.record(projections, files_training, files_validation);
    progress(Step::Trust);
    out.explained = figures::explained(out.training.iter().chain(&out.validation), &out.consistent);
    out.pruning = prune(&out.fit().kept_blocks(), &out.fit().solution.kept, &PruneSettings::default());
    out.trust = Evidence {
        model: &out.model,
        base: &out.base,
        regrouping: &regrouping,
        space: &space,
        prior: &out.prior,
        fitted: &out.fitted,
        consistent: &out.consistent,
        rows: &figures::fit_rows(out.fit(), out.conditioning.as_ref(), kernel_hz),
        explained: &out.explained,
        power: &out.power,
    }
    .trust();
    out.effort_scale = out.scale_of_efforts(config)?;
    Ok(out)
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
        agreement::compare(model, values, log, &self.alignment(), &self.settings)
    }

    /// [`Identification::agreement`] of [`Identification::values`], with what pictures show.
    fn drawn_agreement(&self, log: &PreparedLog) -> Result<Agreement, Error> {
        let (model, values) = self.identified_model();
        self.agreement(self.values(), log)?.draw(model, values, log, &self.alignment(), &self.settings)
    }

    fn alignment(&self) -> Alignment {
        Alignment {
            state_hz: self.state_hz,
            delay_samples: self.delay_samples,
            delay_rate_hz: self.delay_rate_hz,
            filter_hz: self.kernel_hz,
        }
    }

    /// The nonlinear model and its linear parameters that parameters of the fit stand for; `None` if the fit's model is not
    /// linearised.
    fn unfolded(&self, values: &[f64]) -> Result<Option<(RobotModel, Vec<f64>)>, Error> {
        let Some(found) = &self.shapes else { return Ok(None) };
        let unfolded = shape::unfold(&found.model, &self.model, values);
        let mechanism = self.model.mechanism();
        let model = self.plan.model(mechanism)?;
        Ok(Some((model.with_shape(&unfolded.shape), unfolded.linear)))
    }

    /// The identified model and its linear parameters: [`Identification::values`], or what they stand for where the fit's
    /// model is linearised.
    pub fn identified_model(&self) -> (&RobotModel, &[f64]) {
        self.nonlinear.as_ref().map_or((&self.model, self.values()), |(model, values)| (model, values))
    }

    /// Lead of the effort that predictions of a log take into account, samples: that of the fit at the same rate, else 0.
    pub(crate) fn delay_on(&self, log: &PreparedLog) -> f64 {
        agreement::lead(log.rate_hz, self.delay_samples, self.delay_rate_hz)
    }

    /// Predicted effort on a prepared log, per output.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn predict(&self, log: &PreparedLog) -> Result<Vec<Vec<f64>>, Error> {
        let (model, values) = self.identified_model();
        let shape = model.parameters().shape_start();
        Ok(predict(model, &shape, values, log, self.state_hz, self.delay_samples, &self.settings)?)
    }

    /// What speaks for the scale of the efforts.
    fn scale_of_efforts(&self, config: &Config) -> Result<EffortScale, Error> {
        let weighed = effort_scale::mass_columns(&config.known_mass, &self.model)?;
        let of = |(name, column, known): (String, usize, f64)| {
            let trust = &self.trust.parameters[column];
            WeighedMass { name, known, identified: trust.unconstrained, interval: trust.interval }
        };
        let masses = weighed.into_iter().map(of).collect();
        let by_file = effort_scale::by_robot_file(
            &self.model,
            self.values(),
            &self.prior,
            &self.logs,
            self.state_hz,
            &self.settings,
        )?;
        Ok(EffortScale::of(masses, config.known_effort_scale, by_file))
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

    /// Samples of all training logs.
    pub fn samples(&self) -> usize {
        self.logs.iter().map(PreparedLog::samples).sum()
    }
}

pub(crate) fn read_logs(
    config: &Config,
    files: &[LogConfig],
    robot: Robot,
    progress: &mut dyn FnMut(Step),
) -> Result<(Robot, Vec<LoadedLog>), Error> {
    let mut loaded = Vec::with_capacity(files.len());
    for file in files {
        progress(Step::Read(file.path.display().to_string()));
        let motor_side = config.motor_side.as_ref();
        loaded.push(logs::load(file, &robot.axes, &config.columns, motor_side)?);
    }
    // A joint without columns in any log is taken to stand still at zero.
    let mut still: Vec<(String, f64)> = Vec::new();
    for name in loaded.iter().flat_map(|l| &l.not_logged) {
        if !still.iter().any(|(n, _)| n == name) {
            still.push((name.clone(), 0.0));
        }
    }
    if let (Some(_), Some((name, _))) = (&robot.closed, still.first()) {
        return Err(Error::Unsupported(format!(
            "no column for the drive `{name}`: the logs of a mechanism with loops need all its drives"
        )));
    }
    let robot = if still.is_empty() { robot } else { robot.locked(&still)? };
    Ok((robot, loaded))
}

/// What stays of a log's file once its signals are prepared.
pub(crate) struct ReadLog {
    /// Doubts, and what was done about them, in words.
    pub(crate) warnings: Vec<String>,
    /// How columns were understood.
    pub(crate) columns: Vec<(String, String)>,
    /// How the file was read where that was found out.
    pub(crate) reading: Vec<ReadingNote>,
    /// Files that were read.
    pub(crate) inputs: Vec<InputRecord>,
}

/// Robot, logs and model of a run, before anything is fitted.
pub(crate) struct Opened {
    pub(crate) robot: Robot,
    pub(crate) read: Vec<ReadLog>,
    pub(crate) validation: Vec<LoadedLog>,
    pub(crate) plan: ElementPlan,
    pub(crate) model: RobotModel,
    pub(crate) logs: Vec<PreparedLog>,
    pub(crate) structure: Structure,
    pub(crate) own_delays: Vec<OwnDelay>,
    pub(crate) findings: Vec<Finding>,
    pub(crate) overlaps: Overlaps,
}

/// Reads robot and logs, examines them, prepares them for a model with the elements asked for.
///
/// # Errors
/// Fails as [`identify`] does.
pub(crate) fn open(config: &Config, progress: &mut dyn FnMut(Step)) -> Result<Opened, Error> {
    config.check()?;
    config.demand_inputs()?;
    progress(Step::Read(config.robot.display().to_string()));
    open_robot(config, load_robot(config)?, progress)
}

fn load_robot(config: &Config) -> Result<Robot, Error> {
    let options = RobotOptions {
        gravity: config.gravity,
        couple_mimics: config.couple_mimics.unwrap_or(false),
        floating_base: false,
        locked: config.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
    };
    Ok(Robot::load(&config.robot, &options)?.with_registry(config.registry.clone()))
}

fn open_robot(config: &Config, robot: Robot, progress: &mut dyn FnMut(Step)) -> Result<Opened, Error> {
    let settings = config.conditioning_settings();
    if robot.closed.is_none() && robot.mechanism.positions() != robot.mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base cannot be identified from joint logs: lock the base or leave it out".to_owned(),
        ));
    }
    refuse_internal_load(&robot, "identified")?;
    let mut files = config.training_logs();
    if let Some(table) = &config.instruments {
        table.read_reference(&mut files, &config.columns, &logs::names(&robot.axes))?;
    }
    let (robot, mut loaded) = read_logs(config, &files, robot, progress)?;
    // What cannot be read is told before the long work.
    let validation = config
        .validation
        .iter()
        .map(|log| {
            progress(Step::Read(log.path.display().to_string()));
            logs::load(log, &robot.axes, &config.columns, config.motor_side.as_ref())
        })
        .collect::<Result<Vec<_>, Error>>()?;
    let overlaps = Overlaps::of(&loaded, &validation);
    let mut plan = plan_elements(config, &robot, &loaded)?;
    plan.log_terms = LogTerms::of(config, &robot)?;
    for ((loaded, log), label) in loaded.iter_mut().zip(&config.log).zip(config.log_labels()) {
        if !plan.log_terms.is_empty() {
            loaded.log = plan.log_terms.with_gates(loaded.log.clone(), Some(&label), log.payload.as_deref());
        }
    }
    let model = plan.model(&robot.mechanism)?;
    effect::check(config, &plan, &model)?;
    effort_scale::mass_columns(&config.known_mass, &model)?;
    logs::check_stated_temperatures(config.log.iter().chain(&config.validation), &model)?;
    let findings = preflight(config, &robot, &loaded, &overlaps, progress);
    // Signals as they were read go as soon as they are prepared: a log may be most of the memory.
    let mut read = Vec::with_capacity(loaded.len());
    let mut prepared = Vec::with_capacity(loaded.len());
    for log in loaded {
        prepared.push(log.prepare(&model, &settings)?);
        let nearest = model.closed().and_then(|closed| logs::poses::nearest_singularity(closed, &log.log));
        let warnings = nearest.into_iter().chain(log.warnings()).collect();
        read.push(ReadLog { warnings, columns: log.columns, reading: log.reading, inputs: log.inputs });
    }
    for log in &prepared {
        config.check_cutoffs(&log.name, log.rate_hz)?;
    }
    // What cannot be prepared says so in its own words.
    let findings = findings?;

    progress(Step::Structure);
    // Names that do not exist are told before the long work.
    let structure = Structure::of(config, &model, &plan, &prepared)?;
    let start = model.parameters().shape_start();
    let own_delays = own_delay::take_off(config, &model, &start, &structure.base, &mut prepared, &settings)?;
    Ok(Opened {
        robot,
        read,
        validation,
        plan,
        model,
        logs: prepared,
        structure,
        own_delays,
        findings,
        overlaps,
    })
}

/// Examines the training logs before anything is made of them.
fn preflight(
    config: &Config,
    robot: &Robot,
    loaded: &[LoadedLog],
    overlaps: &Overlaps,
    progress: &mut dyn FnMut(Step),
) -> Result<Vec<Finding>, Error> {
    if config.preflight == Preflight::Off {
        return Ok(Vec::new());
    }
    progress(Step::Preflight);
    let findings = check::of_loaded(config, robot, loaded, overlaps)?;
    match findings.iter().find(|f| f.severity == Severity::Error) {
        Some(fault) if config.preflight == Preflight::Refuse => {
            Err(Error::PreflightFault(Box::new(fault.clone())))
        }
        _ => Ok(findings),
    }
}

pub(crate) fn plan_elements(
    config: &Config,
    robot: &Robot,
    logs: &[LoadedLog],
) -> Result<ElementPlan, Error> {
    let names = robot.rate_names();
    let moves =
        |rate: usize| logs.iter().any(|l| l.log.joints().iter().any(|j| j.name == names[rate] && j.moves()));
    let plan = ElementPlan::of_run(config, robot, moves)?;
    let speeds: Vec<Option<f64>> =
        names.iter().map(|name| logs.iter().filter_map(|l| fastest(&l.log, name)).reduce(f64::max)).collect();
    Ok(plan.with_speeds(&robot.mechanism, &speeds))
}

/// Largest mean speed of a joint over [`SPEED_SPAN_S`] of a log.
fn fastest(log: &Log, joint: &str) -> Option<f64> {
    let position = &log.joints().iter().find(|j| j.name == joint)?.position;
    let time = log.time();
    let rows = time.len().checked_sub(1)?;
    let step = (time[rows] - time[0]) / rows as f64;
    let span = ((SPEED_SPAN_S / step).ceil() as usize).clamp(1, rows.max(1));
    (0..=rows.checked_sub(span)?)
        .map(|k| ((position[k + span] - position[k]) / (time[k + span] - time[k])).abs())
        .filter(|v| v.is_finite())
        .reduce(f64::max)
}

/// Sample rate below which a log of a robot is suspected of another unit of time, Hz.
const SLOWEST_HZ: f64 = 10.0;

/// Deviation from a Fourier series, in parts of the position noise, above which a motion does not repeat.
const REPEATS: f64 = 2.0;

/// What is wrong with the clock and the motion of logs.
fn log_warnings(model: &RobotModel, logs: &[PreparedLog]) -> Vec<Caution> {
    let mut out = Vec::new();
    for log in logs {
        let name = short_name(&log.name);
        let mut add =
            |message: String, remedy: String| out.push(Caution::warn(caution::LOG, message, remedy));
        if log.rate_hz < SLOWEST_HZ {
            add(
                format!(
                    "{name}: a sample rate of {} Hz: if the time column is in milliseconds, say so (unit \"ms\"), or state `rate_hz`",
                    log.rate_hz
                ),
                "`time = { column = \"t\", unit = \"ms\" }` or `rate_hz = 500` under `[columns]`".to_owned(),
            );
        }
        if log.clock.dropped > 0 {
            add(
                format!(
                    "{name}: {} rows dropped because their time does not advance (first: row {})",
                    log.clock.dropped,
                    log.clock.first_dropped.unwrap_or(0) + 1
                ),
                "nothing if rows were written twice; else state the rate in place of the clock: `rate_hz = 500` under `[columns]`"
                    .to_owned(),
            );
        }
        if !log.clock.gaps.is_empty() {
            add(
                format!(
                    "{name}: {} gaps in the clock, {} grid samples unusable",
                    log.clock.gaps.len(),
                    log.clock.unusable
                ),
                "record without losing rows, or take a stretch without gaps: `part = [0.0, 0.5]` in the `[[log]]`"
                    .to_owned(),
            );
        }
        for (output, ratio) in log.periodic.iter().flat_map(|m| m.residual_ratio.iter().enumerate()) {
            if let Some(ratio) = ratio.filter(|r| *r > REPEATS) {
                add(
                    format!(
                        "{name}: joint `{}` does not repeat after the stated period: positions lie {ratio:.1} times their noise off the mean period; leave out `trajectory` and `period_s` for this log",
                        model.outputs()[output].name
                    ),
                    "leave out `trajectory` and `period_s` of the `[[log]]`".to_owned(),
                );
            }
        }
        for (output, _) in log.moves.iter().enumerate().filter(|(_, moves)| !**moves) {
            let joint = &model.outputs()[output].name;
            add(
                format!("{name}: joint `{joint}` does not move"),
                format!(
                    "record a motion of it (`dynid design` gives one), or hold it: `{joint} = 0.0` under `[locked]`, at the position that \
                     it has"
                ),
            );
        }
    }
    out
}
