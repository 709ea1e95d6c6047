//! The main job: from a robot file and logs to an identified model.

mod alone;
mod cyclic;
mod effect;
mod elastic;
mod figures;
mod friction;
pub mod known;
mod loads;
mod log_cautions;
mod model_fit;
mod searches;
mod shapes;
mod step;
mod ties;

use dynid_estimate::elimination::{PruneSettings, prune};
use dynid_estimate::identifiability::VisibleSpace;
use dynid_linalg::Mat;
use dynid_model::EffortModel;
use dynid_model::element::scale_name;
use dynid_rows::conditioning::{ConditioningError, ReducedGroup, tell_shared_motions, tell_speeds};

use crate::caution::{self, Caution};
use crate::check::CheckName;
use crate::closed_loop::{self, Comparison, Loop};
use crate::cyclic_doubt;
use crate::effort_scale::{self, EffortScale};
use crate::elements::ElementPlan;
use crate::estimate::log_fit;
use crate::finding::{Finding, Severity};
use crate::fitting::RowResiduals;
pub use crate::identification::Identification;
use crate::input_record::InputRecord;
use crate::joint_stiffness::{self, JointStiffness};
use crate::journal_doubt;
use crate::load_doubt::{Doubted, LoadDoubt};
pub use crate::load_rounds::LoadRounds;
use crate::log::{self, Log, LogSource};
use crate::log_agreement::{self, LogAgreement};
use crate::log_terms::LogTerms;
use crate::overlap::Overlaps;
pub use crate::own_delay::OwnDelay;
pub use crate::problem::Problem;
use crate::robot::{Robot, refuse_internal_load};
use crate::settings::{LogSettings, Preflight, Settings, check_log_effect, labels};
pub use crate::structure::{Structure, effort_sizes, stated_values};
use crate::trained_log::{SPEED_SPAN_S, TrainedLog};
pub use crate::training_log::TrainingLog;
use crate::trust::{self, Evidence, Trust};
use crate::{Error, own_delay, preflight as before, stiffness};
pub(crate) use figures::{EXPLAINED, explained};
pub(crate) use log_cautions::log_cautions;
pub use model_fit::ModelFit;
pub use step::Step;

/// Identifies a robot from logs, validation logs ([`LogSettings::validation`]) among them: examines them, conditions, fits, judges, validates.
///
/// Logs are taken by value, since a long one may be most of the memory: clone what is to be kept.
///
/// Elastic joints without sensors of their load, whose stiffness in the fit is not borne out by the deformation that their encoders show,
/// are taken as stiff ones: the result is that of [`Identification::stiffness`] beside a model of stiff joints. [`Settings::stiff_joints`] asks
/// for that in any case.
///
/// # Errors
/// [`Error`]: bad input. A rank-deficient log is a status of the result, not an error.
pub fn identify(
    robot: &Robot,
    logs: impl IntoIterator<Item = Log>,
    settings: &Settings,
    progress: &mut dyn FnMut(Step),
) -> Result<Identification, Error> {
    let elastic = &robot.elements.elastic;
    if settings.stiff_joints && elastic.iter().all(|spec| spec.sensor) {
        let found = if elastic.is_empty() { "none that is `elastic`" } else { "torque sensors" };
        return Err(Error::setting("stiff_joints", "elastic joints without torque sensors", found));
    }
    let logs: Vec<Log> = logs.into_iter().collect();
    // A second look at elastic joints needs their logs once more.
    let kept = if elastic.is_empty() { Vec::new() } else { logs.clone() };
    let mut found = run(robot.clone(), logs, settings, progress)?;
    let stiffness = stiffness::of(&found)?;
    let borne_out = stiffness.iter().all(JointStiffness::is_borne_out);
    let asked = settings.stiff_joints;
    if asked && stiffness.is_empty() {
        let what = "no log shows a deformation of the joints (gaps, records of less than half a second), which `stiff_joints` needs";
        return Err(Error::Unsupported(what.to_owned()));
    }
    if borne_out && !asked {
        found.stiffness = stiffness;
        return Ok(found);
    }
    let doubts = elastic::warnings(&found.model, &found.logs);
    let stiff_joints = stiffness::stiff_joints(&found);
    drop(found);
    let logs = kept.into_iter().map(|log| stiffness::at_motors(log, elastic, false));
    let logs = logs.collect::<Result<Vec<_>, Error>>()?;
    let settings = stiffness::stiff_settings(settings, robot);
    let mut found = run(stiffness::stiff_robot(robot)?, logs, &settings, progress)?;
    found.warnings.extend(doubts);
    if !borne_out {
        let message = format!(
            "the deformation does not bear out the stiffness that rows of links and motors give: joints are taken as stiff, read at their \
             motors, and their stiffness is that of the deformation: {}",
            stiffness.iter().map(JointStiffness::words).collect::<Vec<_>>().join("; ")
        );
        found.warnings.push(Caution::warn(caution::SPRING, message, joint_stiffness::REMEDY));
    }
    found.stiffness = stiffness;
    found.stiff_joints = stiff_joints;
    Ok(found)
}

/// One run with a robot as it is given.
fn run(
    robot: Robot,
    logs: Vec<Log>,
    settings: &Settings,
    progress: &mut dyn FnMut(Step),
) -> Result<Identification, Error> {
    let Opened { mut problem, read, validation, own_delays, findings, overlaps } =
        open(robot, logs, settings, progress)?;
    let conditioning = problem.condition(&mut |stage| progress(Step::Conditioning(stage)))?;
    let mut warnings = problem.robot.cautions(&problem.structure.prior, problem.model.ties());
    if !problem.plan.has_journals() {
        warnings.extend(problem.robot.clearance_warnings().map(|message| {
            let remedy = "`dynid clearance ROBOT dynid-out/estimate.json --log LOG`, with your files, tells the gap and its friction from the \
                          effort; without `clearance = \"ideal\"` under `[elements]` the journals move";
            Caution::warn(caution::CLEARANCE, message, remedy)
        }));
    }
    warnings.extend(problem.plan.alike(&problem.robot.mechanism).iter().map(|pair| {
        let remedy = format!(
            "leave one of them out: `{} = [..]` under `[elements.joint]` lists those to keep",
            pair.joint
        );
        Caution::warn(caution::ELEMENTS, pair.to_string(), remedy)
    }));
    let (problem, fit) = problem.fit(conditioning, progress)?;
    warnings.extend(problem.plan.idle_ties(&problem.model).map(|(tie, idle)| {
        let message =
            format!("the tie {{ {} }} does not tie {idle}: no part of the model has it", tie.words());
        Caution::warn(
            caution::ELEMENTS,
            message,
            "leave the tie out, or log the joints and give them the elements that it names",
        )
    }));
    let tie_test = ties::test(&problem, &fit)?;
    if problem.settings.estimator.search.is_some() {
        progress(Step::Searches);
    }
    let searches = searches::run(&problem, &fit)?;
    let (comparison, not_compared) = compared(&problem, &fit, progress)?;
    let of_reading = read.iter().flat_map(|log| log.warnings.iter().cloned());
    let of_reading = of_reading.chain(validation.iter().flat_map(Log::warnings));
    let reading = of_reading.map(|message| {
        let remedy = format!(
            "`{} --report check.html` draws the signals as they were read; columns and units are stated under `[columns]`",
            problem.settings.files.check()
        );
        Caution::warn(caution::LOG, message, remedy)
    });
    let reading = reading.collect();
    let training = TrainedLog::of_all(&problem.logs);
    let sources = read.into_iter().map(|log| log.source).collect();
    let beside = Beside { training, sources, findings, overlaps, own_delays, warnings, reading, comparison };
    let (mut out, left) = assemble(problem, fit, beside)?;
    for (l, log) in out.logs.clone().iter().enumerate() {
        progress(Step::Validate(log.name.clone()));
        let agreement = out.drawn_agreement(log)?;
        out.whiteness.push(left.residuals.whiteness(l, &agreement, out.kernel_hz));
        if out.consistent.constrained() {
            let free = out.agreement(out.unconstrained_values(), log)?;
            out.training_unconstrained.push(log_fit(&free));
        }
        out.training.push(agreement);
    }
    (out.tie_test, out.searches) = (tie_test, searches);
    out.journals = journal_doubt::look(&out.model, &out.logs, out.state_hz, &out.conditioning_settings)?;
    out.warnings.extend(not_compared);
    for log in validation {
        progress(Step::Validate(log.log.name().to_owned()));
        out.validate(log)?;
    }
    progress(Step::Trust);
    out.explained =
        explained(out.training.iter().chain(&out.validation), out.model.outputs().len(), &out.consistent);
    out.judge(&left)?;
    Ok(out)
}

/// What an identification knows beside its problem and its fit.
pub(crate) struct Beside {
    pub(crate) training: Vec<TrainedLog>,
    pub(crate) sources: Vec<LogSource>,
    pub(crate) findings: Vec<Finding>,
    pub(crate) overlaps: Overlaps,
    pub(crate) own_delays: Vec<OwnDelay>,
    pub(crate) warnings: Vec<Caution>,
    /// Doubts about how logs were read.
    pub(crate) reading: Vec<Caution>,
    pub(crate) comparison: Option<Comparison>,
}

/// What of a fit no identification keeps, but its judgement needs.
pub(crate) struct Left {
    residuals: RowResiduals,
    regrouping: Mat,
    space: VisibleSpace,
}

/// An identification before samples are predicted and parameters judged.
pub(crate) fn assemble(
    problem: Problem,
    fit: ModelFit,
    beside: Beside,
) -> Result<(Identification, Left), Error> {
    let Beside {
        training: trained,
        sources,
        findings,
        overlaps,
        own_delays,
        mut warnings,
        reading,
        comparison,
    } = beside;
    let log_agreement = log_agreement::test(&problem, &fit.fitted, |log: &str| {
        let table = fit.shapes.as_ref().map(|found| found.model.parameters());
        table.and_then(|table| table.shape_value(&scale_name(log))).unwrap_or(1.0)
    });
    let ModelFit {
        conditioning,
        friction,
        cyclic,
        slow,
        shapes,
        simulations,
        residuals,
        fitted,
        groups,
        consistent,
        power,
        loads,
    } = fit;
    let Problem { robot, plan, model, structure, logs: prepared, training, settings } = problem;
    warnings.extend(effect::warnings(&settings, shapes.is_some()));
    let Structure { base, stated, effort_sizes, prior, regrouping, space, bounds, .. } = structure;
    let conditioned = settings.conditioning_settings();
    let state_hz = model_fit::state_hz(&settings, conditioning.as_ref());
    let (kernel_hz, delay_samples) = match &conditioning {
        Some(c) => (c.kernel_hz, c.delay.samples),
        None => (state_hz, 0.0),
    };
    let row_rms = figures::row_rms(&groups, &fitted.estimate.x, base.len());
    let residual_ratio = figures::residual_ratios(&groups, &fitted.estimate, &trained, kernel_hz);
    warnings.extend(findings.iter().filter_map(Finding::caution));
    warnings.extend(prior.warnings.iter().map(|message| {
        let remedy = "state mass, centre of mass and inertia of the link in the robot file: `<inertial>` in a URDF, `mass`, `com` and \
                      `inertia_com = [xx, xy, xz, yy, yz, zz]` in TOML";
        Caution::warn(caution::ROBOT_FILE, message, remedy)
    }));
    warnings.extend(reading);
    warnings.extend(log_cautions(&model, &prepared));
    warnings.extend(elastic::warnings(&model, &prepared));
    warnings.extend(known::warnings(&plan, &robot.mechanism, &prepared));
    warnings.extend(log_agreement.iter().flat_map(LogAgreement::warnings).map(|message| {
        let remedy = "give the log terms of its own in its `[[log]]`: `own = [\"offset\"]`, `own = [\"friction\"]`, \
                      `own = [\"friction_scale\"]` or `own = [\"delay\"]`; what it carries: `payload = \"tool\"`";
        Caution::warn(CheckName::AgreementOfLogs.word(), message, remedy)
    }));
    let rows: usize = groups.iter().map(ReducedGroup::rows).sum();
    let mut out = Identification {
        sources,
        stiffness: Vec::new(),
        stiff_joints: Vec::new(),
        plan,
        base_scales: space.base_std().to_vec(),
        base,
        effort_sizes,
        bounds,
        conditioning,
        friction,
        cyclic,
        slow,
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
        delay_rate_hz: trained[0].rate_hz,
        trained,
        training: Vec::new(),
        row_fits: Vec::new(),
        recipe_doubts: Vec::new(),
        validation: Vec::new(),
        validation_logs: Vec::new(),
        training_unconstrained: Vec::new(),
        validation_unconstrained: Vec::new(),
        whiteness: Vec::new(),
        pruning: None,
        log_agreement,
        own_delays,
        warnings,
        findings,
        overlaps,
        effort_scale: EffortScale::default(),
        conditioning_settings: conditioned,
        settings,
        log_settings: training.into_iter().map(|log| (log.label, log.settings)).collect(),
        power,
        logs: prepared,
        robot,
        model,
        shapes,
        nonlinear: None,
        alone: None,
        simulations,
        comparison,
        loads,
        tie_test: None,
        searches: None,
        journals: Vec::new(),
    };
    out.nonlinear = out.unfolded(out.values())?;
    out.alone = out.without_logs()?;
    Ok((out, Left { residuals, regrouping, space }))
}

impl Identification {
    /// Pruning, verdicts of the parameters and the scale of the efforts, once it is known which efforts the model explains.
    pub(crate) fn judge(&mut self, left: &Left) -> Result<(), Error> {
        self.pruning = prune(&self.fit().kept_blocks(), &self.fit().solution.kept, &PruneSettings::default());
        let doubts = self.doubt_loads(&left.regrouping)?;
        self.trust = Evidence {
            model: &self.model,
            base: &self.base,
            regrouping: &left.regrouping,
            space: &left.space,
            prior: &self.prior,
            fitted: &self.fitted,
            consistent: &self.consistent,
            rows: &figures::fit_rows(self.fit(), &self.row_rms, self.conditioning.as_ref(), self.kernel_hz),
            explained: &self.explained,
            power: &self.power,
            doubts: &doubts,
        }
        .trust();
        self.effort_scale = self.scale_of_efforts()?;
        Ok(())
    }

    /// What the loads of journals say of their friction coefficients, added to the covariance of the fit.
    fn doubt_loads(&mut self, regrouping: &Mat) -> Result<Vec<Doubted>, Error> {
        let values = &self.consistent.unconstrained;
        let doubt =
            LoadDoubt::of(&self.model, values, &self.logs, self.state_hz, &self.conditioning_settings)?;
        if doubt.is_empty() {
            return Ok(Vec::new());
        }
        let Some(after) = trust::after(&self.fitted, regrouping, &self.prior) else { return Ok(Vec::new()) };
        let covariances = doubt.covariances(&after, values);
        let base = |column: usize| self.base.kept.iter().position(|kept| *kept == column);
        let of_base: Vec<(usize, usize, f64)> =
            covariances.iter().filter_map(|(a, b, c)| Some((base(*a)?, base(*b)?, *c))).collect();
        let doubted = doubt.doubted(&covariances, values);
        self.fitted.add_covariances(&of_base);
        Ok(doubted)
    }

    /// Predicts a validation log and compares.
    pub(crate) fn validate(&mut self, mut log: Log) -> Result<(), Error> {
        log.log = self.plan.log_terms.of_validation(log.log, &log.settings);
        let mut prepared = log.prepare(&self.model, &self.conditioning_settings)?;
        if let Some(choices) = self.conditioning.as_ref().filter(|choices| !choices.rms_speed.is_empty()) {
            prepared.tell_speeds(&choices.rms_speed);
        }
        if let Some(own) = self.own_delays.iter().find(|d| Some(&d.log) == log.settings.like.as_ref()) {
            own.take_off(&mut prepared)?;
        }
        self.sources.push(log.source);
        self.warnings.extend(known::cautions(known::logged_beyond(&self.plan.known, &prepared)));
        let agreement = self.drawn_agreement(&prepared)?;
        let doubts = cyclic_doubt::doubts(
            self.identified_model(),
            &prepared,
            &self.alignment(),
            &self.conditioning_settings,
            &agreement,
        )?;
        let doubts = doubts.into_iter().map(|m| Caution::warn(caution::CYCLIC, m, cyclic_doubt::REMEDY));
        self.warnings.extend(doubts);
        self.validation.push(agreement);
        if self.consistent.constrained() {
            let free = self.agreement(self.unconstrained_values(), &prepared)?;
            self.validation_unconstrained.push(log_fit(&free));
        }
        self.validation_logs.push(prepared);
        Ok(())
    }
}

/// Least squares against instruments where the settings describe the closed loop, or why they were not compared.
fn compared(
    problem: &Problem,
    fit: &ModelFit,
    progress: &mut dyn FnMut(Step),
) -> Result<(Option<Comparison>, Option<Caution>), Error> {
    if problem.settings.closed_loop.is_none() {
        return Ok((None, None));
    }
    progress(Step::Instruments);
    let closed = Loop {
        problem,
        shapes: fit.shapes.as_ref(),
        conditioning: fit.conditioning.as_ref(),
        power: &fit.power,
    };
    match closed_loop::compare(&closed, fit.fitted.merged_blocks) {
        Ok(found) => Ok((Some(found), None)),
        Err(Error::Unsupported(why)) => {
            let message = format!("least squares was not compared with instruments: {why}");
            let name = CheckName::Instruments.word();
            Ok((None, Some(Caution::warn(name, message, "leave out `[instruments]`"))))
        }
        Err(other) => Err(other),
    }
}

/// Locks joints without signals in any log: each is taken to stand still at zero.
///
/// # Errors
/// [`Error::Unsupported`] for a drive of a mechanism with loops that no log holds.
pub fn held_where_not_logged(robot: Robot, logs: &[Log]) -> Result<Robot, Error> {
    let mut still: Vec<(String, f64)> = Vec::new();
    for name in logs.iter().flat_map(|log| log.not_logged(&robot.axes)) {
        if !still.iter().any(|(n, _)| *n == name) {
            still.push((name, 0.0));
        }
    }
    if let (Some(_), Some((name, _))) = (&robot.closed, still.first()) {
        return Err(Error::Unsupported(format!(
            "no column for the drive `{name}`: the logs of a mechanism with loops need all its drives"
        )));
    }
    if still.is_empty() { Ok(robot) } else { robot.locked(&still) }
}

/// What stays of a log once its signals are prepared.
#[derive(Debug)]
pub(crate) struct ReadLog {
    /// Doubts, and what was done about them, in words.
    pub(crate) warnings: Vec<String>,
    pub(crate) source: LogSource,
}

/// A problem and its logs before anything is fitted.
#[derive(Debug)]
pub struct Opened {
    /// The problem.
    pub problem: Problem,
    pub(crate) read: Vec<ReadLog>,
    pub(crate) validation: Vec<Log>,
    /// Delays of single logs, taken off their efforts.
    pub own_delays: Vec<OwnDelay>,
    /// What the pre-flight found.
    pub findings: Vec<Finding>,
    /// Rows that logs share.
    pub overlaps: Overlaps,
}

impl Opened {
    /// Files that the training logs were read from.
    pub fn inputs(&self) -> impl Iterator<Item = &InputRecord> {
        self.read.iter().flat_map(|log| &log.source.inputs)
    }
}

/// Examines logs and prepares them for a model with the elements asked for.
///
/// # Errors
/// Fails as [`identify`] does.
pub fn open(
    robot: Robot,
    logs: Vec<Log>,
    settings: &Settings,
    progress: &mut dyn FnMut(Step),
) -> Result<Opened, Error> {
    let mut settings = settings.clone();
    let (validation, mut loaded): (Vec<Log>, Vec<Log>) =
        logs.into_iter().partition(|log| log.settings.validation);
    if loaded.is_empty() {
        return Err(Error::setting("log", "at least one log to identify from", "none"));
    }
    if settings.files.logs.is_empty() {
        settings.files.logs = loaded.iter().map(|log| log.log.name().into()).collect();
        settings.files.robot = robot.path.clone();
    }
    let labels = labels(loaded.iter().map(|log| (&log.settings, log.log.name())));
    let training: Vec<TrainingLog> = (loaded.iter().zip(labels))
        .map(|(log, label)| TrainingLog {
            label,
            settings: log.settings.clone(),
            reference: log.reference.clone(),
        })
        .collect();
    check_settings(&settings, &training, &loaded, &validation)?;
    if robot.closed.is_none() && robot.mechanism.positions() != robot.mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base cannot be identified from joint logs: lock the base or leave it out".to_owned(),
        ));
    }
    refuse_internal_load(&robot, "identified")?;
    let robot = held_where_not_logged(robot, &loaded)?;
    let overlaps = Overlaps::of(&loaded, &validation);
    let mut plan = plan_elements(&settings, &robot, &loaded)?;
    plan.log_terms = LogTerms::of(&settings, &training, &robot)?;
    if !plan.log_terms.is_empty() {
        for (log, TrainingLog { label, settings, .. }) in loaded.iter_mut().zip(&training) {
            log.log = plan.log_terms.with_gates(log.log.clone(), Some(label), settings.payload.as_deref());
        }
    }
    let model = plan.tied_model(&robot.mechanism)?;
    let of_training: Vec<&LogSettings> = training.iter().map(|log| &log.settings).collect();
    let sources = loaded.iter().chain(&validation).map(|log| &log.source);
    let stated: Vec<String> = sources.flat_map(|source| source.stated_channels.iter().cloned()).collect();
    effect::check(&settings, &of_training, &stated, &plan, &model)?;
    effort_scale::mass_columns(&settings.known_mass, &model)?;
    let of_validation = validation.iter().map(|log| &log.settings);
    log::check_stated_temperatures(of_training.iter().copied().chain(of_validation), &model)?;
    let conditioned = settings.conditioning_settings();
    if settings.preflight != Preflight::Off {
        progress(Step::Preflight);
    }
    // Neither keeps both cores busy.
    let (findings, first) = rayon::join(
        || preflight(&settings, &robot, &loaded, &overlaps),
        || loaded[0].prepare(&model, &conditioned),
    );
    // Signals as they were read go as soon as they are prepared: a log may be most of the memory.
    let mut first = Some(first);
    let mut read = Vec::with_capacity(loaded.len());
    let mut prepared = Vec::with_capacity(loaded.len());
    for log in loaded {
        prepared.push(first.take().unwrap_or_else(|| log.prepare(&model, &conditioned))?);
        let nearest = model.closed().and_then(|closed| log::poses::nearest_singularity(closed, &log.log));
        let warnings = nearest.into_iter().chain(log.warnings()).collect();
        read.push(ReadLog { warnings, source: log.source });
    }
    tell_shared_motions(&mut prepared);
    tell_speeds(&mut prepared);
    for log in &prepared {
        settings.check_cutoffs(&log.name, log.rate_hz)?;
    }
    for (output, of_joint) in model.outputs().iter().enumerate() {
        if prepared.iter().all(|log| log.held[output]) {
            let (log, joint) = (prepared[0].name.clone(), of_joint.name.clone());
            return Err(ConditioningError::ConstantEffort { log, joint }.into());
        }
    }
    // What cannot be prepared says so in its own words.
    let findings = findings?;

    progress(Step::Structure);
    // Names that do not exist are told before the long work.
    let structure = Structure::of(&settings, &robot, &model, &plan, &prepared)?;
    let base = &structure.base;
    let own_delays =
        own_delay::take_off(&settings, &training, &model, &structure.shape, base, &mut prepared)?;
    let problem = Problem { robot, plan, model, structure, logs: prepared.into(), training, settings };
    Ok(Opened { problem, read, validation, own_delays, findings, overlaps })
}

/// Refuses settings that make no sense, or do nothing beside the others.
fn check_settings(
    settings: &Settings,
    training: &[TrainingLog],
    logs: &[Log],
    validation: &[Log],
) -> Result<(), Error> {
    settings.check()?;
    settings.check_effect()?;
    let of_training: Vec<&LogSettings> = training.iter().map(|log| &log.settings).collect();
    let of_validation: Vec<&LogSettings> = validation.iter().map(|log| &log.settings).collect();
    let labels: Vec<String> = training.iter().map(|log| log.label.clone()).collect();
    let files: Vec<&str> = logs.iter().map(|log| log.log.name()).collect();
    settings.check_logs(&of_training, &of_validation, &labels)?;
    settings.check_periods(&of_training, &files)?;
    check_log_effect(&of_training, &of_validation, &labels, &files)
}

/// Examines the training logs before anything is made of them.
pub(crate) fn preflight(
    settings: &Settings,
    robot: &Robot,
    loaded: &[Log],
    overlaps: &Overlaps,
) -> Result<Vec<Finding>, Error> {
    match bench_of(settings, robot)? {
        Some(bench) => preflight_on(&bench, settings, loaded, overlaps),
        None => Ok(Vec::new()),
    }
}

/// What logs are examined with; `None` where they are not to be.
pub(crate) fn bench_of(settings: &Settings, robot: &Robot) -> Result<Option<before::Bench>, Error> {
    let on = settings.preflight != Preflight::Off;
    on.then(|| before::Bench::new(settings, robot)).transpose()
}

/// The same with the elements of a plan, as a recipe has them.
///
/// # Errors
/// As [`bench_of`].
pub(crate) fn bench_with(
    plan: &ElementPlan,
    settings: &Settings,
    robot: &Robot,
) -> Result<Option<before::Bench>, Error> {
    let on = settings.preflight != Preflight::Off;
    on.then(|| before::Bench::with(plan, settings, robot)).transpose()
}

/// [`preflight`] with what logs are examined with.
pub(crate) fn preflight_on(
    bench: &before::Bench,
    settings: &Settings,
    loaded: &[Log],
    overlaps: &Overlaps,
) -> Result<Vec<Finding>, Error> {
    let findings = before::of_logs(bench, loaded, overlaps)?;
    match findings.iter().find(|f| f.severity == Severity::Error) {
        Some(fault) if settings.preflight == Preflight::Refuse => {
            Err(Error::PreflightFault(Box::new(fault.clone())))
        }
        _ => Ok(findings),
    }
}

/// Elements of the joints that logs move, with bounds for the speeds that they reach.
///
/// # Errors
/// Names and settings that no element has.
pub fn plan_elements(settings: &Settings, robot: &Robot, logs: &[Log]) -> Result<ElementPlan, Error> {
    let names = robot.rate_names();
    let moves =
        |rate: usize| logs.iter().any(|l| l.log.joints().iter().any(|j| j.name == names[rate] && j.moves()));
    let plan = ElementPlan::of_run(settings, robot, moves)?;
    let speeds: Vec<Option<f64>> =
        names.iter().map(|name| logs.iter().filter_map(|l| fastest(&l.log, name)).reduce(f64::max)).collect();
    Ok(plan.with_speeds(&robot.mechanism, &speeds))
}

/// Largest mean speed of a joint over [`SPEED_SPAN_S`] of a log.
fn fastest(log: &dynid_motion::Log, joint: &str) -> Option<f64> {
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
