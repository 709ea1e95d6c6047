//! The main job: from a robot file and logs to an identified model.

use std::path::Path;

use dynid_estimate::conditioning::{
    Conditioning, ConditioningSettings, PreparedLog, ReducedGroup, Stage, condition, predict, prepare,
    reduce, reduce_textbook,
};
use dynid_estimate::covariance::{MIN_BLOCKS, jackknife, weighted_blocks};
use dynid_estimate::linear::{WlsEstimate, WlsSettings, wls};
use dynid_estimate::{Factor, Mat};
use dynid_model::{BaseParameters, BaseSettings, EffortModel, RobotModel};

use crate::Error;
use crate::agreement::{self, Agreement};
use crate::config::{Config, LogConfig, Method, Route};
use crate::elements::ElementPlan;
use crate::logs::{self, LoadedLog};
use crate::robot::{Robot, RobotOptions};

/// What is being worked on, for progress displays.
#[derive(Debug, Clone, PartialEq)]
pub enum Step {
    /// Reading a file.
    Read(String),
    /// Structural analysis.
    Structure,
    /// A step of the conditioning.
    Conditioning(Stage),
    /// Final fit.
    Fit,
    /// Covariance.
    Covariance,
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
    /// The effort model.
    pub model: RobotModel,
    /// Base parameters of the model.
    pub base: BaseParameters,
    /// Training logs.
    pub logs: Vec<PreparedLog>,
    /// How their columns were understood.
    pub columns: Vec<Vec<(String, String)>>,
    /// Choices of the compact route; `None` on the textbook route.
    pub conditioning: Option<Conditioning>,
    /// Weighted (or ordinary) least squares in the base columns.
    pub fit: WlsEstimate,
    /// Covariance for white residuals, of the kept columns of the fit.
    pub white: Mat<f64>,
    /// Jackknife covariance over time blocks, if there are enough of them.
    pub jackknife: Option<Mat<f64>>,
    /// Number of time blocks.
    pub blocks: usize,
    /// All linear parameters: base values as identified, split as near as possible to the robot file.
    pub values: Vec<f64>,
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
    /// Warnings, in words.
    pub warnings: Vec<String>,
    /// Settings of the conditioning.
    pub settings: ConditioningSettings,
}

/// Reads robot and logs, conditions, fits, validates.
///
/// # Errors
/// [`Error`]: bad input. A rank-deficient log is a status of the result, not an error.
pub fn identify(config: &Config, mut progress: impl FnMut(Step)) -> Result<Identification, Error> {
    config.check()?;
    let settings = config.conditioning_settings();
    progress(Step::Read(config.robot.display().to_string()));
    let options = RobotOptions {
        gravity: config.gravity,
        couple_mimics: config.couple_mimics.unwrap_or(false),
        floating_base: false,
        locked: config.locked.iter().map(|(j, x)| (j.clone(), *x)).collect(),
    };
    let robot = Robot::load(&config.robot, &options)?;
    if robot.mechanism.positions() != robot.mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base cannot be identified from joint logs: lock the base or leave it out".to_owned(),
        ));
    }
    let (robot, loaded) = read_logs(config, &config.log, robot, &mut progress)?;
    let plan = plan_elements(config, &robot, &loaded)?;
    let model = RobotModel::new(robot.mechanism.clone(), plan.build(&robot.mechanism)?);
    let prepared =
        loaded.iter().map(|l| Ok(prepare(&l.log, &model, &settings)?)).collect::<Result<Vec<_>, Error>>()?;

    for log in &prepared {
        config.check_cutoffs(&log.name, log.rate_hz)?;
    }

    progress(Step::Structure);
    let base_settings = BaseSettings {
        seed: config.seed.unwrap_or(1),
        preferred: preferred_columns(config, &model)?,
        ..BaseSettings::default()
    };
    let base = BaseParameters::of(&model, model.mechanism(), &[], &base_settings);
    if base.is_empty() {
        return Err(Error::Unsupported("no parameter of this robot acts on any effort".to_owned()));
    }

    let (conditioning, groups) = match config.conditioning.route {
        Route::Compact => {
            let found = condition(&model, &[], &base.kept, &prepared, &settings, |stage| {
                progress(Step::Conditioning(stage));
            })?;
            progress(Step::Fit);
            let groups = reduce(&model, &[], &base.kept, &prepared, &found, &settings)?;
            (Some(found), groups)
        }
        Route::Textbook => {
            progress(Step::Fit);
            let route = config.textbook_route();
            (None, reduce_textbook(&model, &[], &base.kept, &prepared, &route, &settings)?)
        }
    };
    let rows: usize = groups.iter().map(ReducedGroup::rows).sum();
    if rows <= base.len() {
        return Err(Error::TooShort {
            file: config.log[0].path.display().to_string(),
            message: format!(
                "{rows} usable rows for {} parameters, expected more rows than parameters",
                base.len()
            ),
        });
    }
    let fit = fit(config.estimator.method, &groups, base.len());

    progress(Step::Covariance);
    let white = fit.solution.unit_covariance();
    let blocks = time_blocks(&groups, &fit, base.len());
    let jackknife = (blocks.len() >= MIN_BLOCKS)
        .then(|| {
            let kept: Vec<f64> = fit.solution.kept.iter().map(|c| fit.solution.x[*c]).collect();
            jackknife(&blocks, &kept)
        })
        .flatten()
        .map(|j| j.covariance);

    let stated = stated_values(&model, &plan);
    let prior: Vec<f64> = stated.iter().map(|v| v.unwrap_or(0.0)).collect();
    // Base parameters that the logs do not excite keep the robot file's value.
    let mut beta = base.values(&prior);
    for c in &fit.solution.kept {
        beta[*c] = fit.solution.x[*c];
    }
    let values = base.nearest(&beta, &prior, &parameter_scales(&model));

    let (state_hz, kernel_hz, delay_samples) = match &conditioning {
        Some(c) => (c.state_hz.iter().copied().fold(f64::INFINITY, f64::min), c.kernel_hz, c.delay.samples),
        None => {
            let cutoff = config.textbook_route().cutoff_hz;
            (cutoff, cutoff, 0.0)
        }
    };
    let row_rms = row_rms(&groups, &fit.solution.x, base.len());
    let residual_ratio = residual_ratios(&groups, &fit, &prepared, kernel_hz);
    let mut warnings = robot.warnings.clone();
    warnings.extend(log_warnings(&model, &prepared));
    let mut out = Identification {
        plan,
        base,
        columns: loaded.into_iter().map(|l| l.columns).collect(),
        conditioning,
        fit,
        white,
        jackknife,
        blocks: blocks.len(),
        values,
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
        warnings,
        settings,
        logs: Vec::new(),
        robot,
        model,
    };
    for log in &prepared {
        progress(Step::Validate(log.name.clone()));
        out.training.push(out.agreement(log)?);
    }
    out.logs = prepared;
    for log in &config.validation {
        progress(Step::Validate(log.path.display().to_string()));
        let loaded = logs::load(log, &out.robot.mechanism, &config.columns, config.motor_side.as_ref())?;
        let prepared = prepare(&loaded.log, &out.model, &out.settings)?;
        out.validation.push(out.agreement(&prepared)?);
    }
    Ok(out)
}

impl Identification {
    /// Predicts a log and compares.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn agreement(&self, log: &PreparedLog) -> Result<Agreement, Error> {
        agreement::compare(
            &self.model,
            &self.values,
            log,
            &agreement::Alignment {
                state_hz: self.state_hz,
                delay_samples: self.delay_samples,
                delay_rate_hz: self.delay_rate_hz,
                filter_hz: self.kernel_hz,
            },
            &self.settings,
        )
    }

    /// Predicted effort on a prepared log, per output.
    ///
    /// # Errors
    /// [`Error::Conditioning`].
    pub fn predict(&self, log: &PreparedLog) -> Result<Vec<Vec<f64>>, Error> {
        Ok(predict(&self.model, &[], &self.values, log, self.state_hz, self.delay_samples, &self.settings)?)
    }

    /// Standard deviations of all base parameters: reported and white; `None` where a column was dropped.
    pub fn standard_deviations(&self) -> Vec<(Option<f64>, Option<f64>)> {
        let mut out = vec![(None, None); self.base.len()];
        for (k, c) in self.fit.solution.kept.iter().enumerate() {
            let white = self.white[(k, k)].max(0.0).sqrt();
            let reported = self.jackknife.as_ref().map_or(white, |v| v[(k, k)].max(0.0).sqrt());
            out[*c] = (Some(reported), Some(white));
        }
        out
    }

    /// Samples of all training logs.
    pub fn samples(&self) -> usize {
        self.logs.iter().map(PreparedLog::samples).sum()
    }
}

fn read_logs(
    config: &Config,
    files: &[LogConfig],
    robot: Robot,
    progress: &mut impl FnMut(Step),
) -> Result<(Robot, Vec<LoadedLog>), Error> {
    let mut loaded = Vec::with_capacity(files.len());
    for file in files {
        progress(Step::Read(file.path.display().to_string()));
        let motor_side = config.motor_side.as_ref();
        loaded.push(logs::load(file, &robot.mechanism, &config.columns, motor_side)?);
    }
    // A joint without columns in any log is taken to stand still at zero.
    let mut still: Vec<(String, f64)> = Vec::new();
    for name in loaded.iter().flat_map(|l| &l.not_logged) {
        if !still.iter().any(|(n, _)| n == name) {
            still.push((name.clone(), 0.0));
        }
    }
    let robot = if still.is_empty() { robot } else { robot.locked(&still)? };
    Ok((robot, loaded))
}

fn plan_elements(config: &Config, robot: &Robot, logs: &[LoadedLog]) -> Result<ElementPlan, Error> {
    let names = robot.mechanism.rate_names();
    let mut spec = robot.elements.clone();
    for (joint, list) in &config.elements.joint {
        spec.per_joint.retain(|(j, _)| j != joint);
        spec.per_joint.push((joint.clone(), list.clone()));
    }
    spec.couplings.extend(config.coupling.iter().map(|c| dynid_io::CouplingSpec {
        motors: c.motors.clone(),
        joints: c.joints.clone(),
        matrix: c.matrix.clone(),
        form: c.form,
    }));
    ElementPlan::new(&robot.mechanism, &spec, config.elements.default.as_deref(), |rate| {
        logs.iter().any(|l| l.log.joints().iter().any(|j| j.name == names[rate] && j.moves()))
    })
}

fn preferred_columns(config: &Config, model: &RobotModel) -> Result<Vec<usize>, Error> {
    config
        .preferred
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

fn fit(method: Method, groups: &[ReducedGroup], columns: usize) -> WlsEstimate {
    let factors: Vec<Factor> = groups.iter().map(|g| g.merged(columns)).collect();
    match method {
        Method::Wls => wls(&factors, &WlsSettings::default()),
        // One group: one variance for all rows.
        Method::Ols => wls(&[Factor::merge(&factors.iter().collect::<Vec<_>>())], &WlsSettings::default()),
    }
}

/// Weighted factors of the time blocks of all logs, all joints of a block merged.
fn time_blocks(groups: &[ReducedGroup], fit: &WlsEstimate, columns: usize) -> Vec<Factor> {
    let logs = groups.iter().map(|g| g.log + 1).max().unwrap_or(0);
    let mut out = Vec::new();
    for log in 0..logs {
        let (mut factors, mut variances) = (Vec::new(), Vec::new());
        for (k, group) in groups.iter().enumerate().filter(|(_, g)| g.log == log) {
            // A single variance belongs to all groups alike.
            variances.push(fit.groups[if fit.groups.len() == 1 { 0 } else { k }].variance);
            factors.push(group.blocks.iter().map(|b| b.embed(columns, &group.columns)).collect::<Vec<_>>());
        }
        out.extend(
            weighted_blocks(&factors, &variances, &fit.solution.kept).into_iter().filter(|b| b.rows() > 0),
        );
    }
    out
}

/// What the robot file states: link inertias, element values.
fn stated_values(model: &RobotModel, plan: &ElementPlan) -> Vec<Option<f64>> {
    let table = model.parameters();
    let mut stated: Vec<Option<f64>> = table.linear.iter().map(|p| p.prior).collect();
    for (name, value) in plan.stated_values() {
        if let Some(column) = table.column(&name) {
            stated[column] = Some(value);
        }
    }
    stated
}

/// By how much a parameter may differ from the robot file: half the mass, and the moments that this mass has at the
/// size of the link (spec/estimation.md section 6).
fn parameter_scales(model: &RobotModel) -> Vec<f64> {
    let mechanism = model.mechanism();
    let masses: Vec<f64> = mechanism.bodies().iter().map(|b| b.inertia.mass().max(0.0)).collect();
    let mean = masses.iter().sum::<f64>() / masses.len().max(1) as f64;
    let mean = if mean > 0.0 { mean } else { 5.0 };
    let mut scales = Vec::with_capacity(model.parameters().linear.len());
    let mut of_body = Vec::new();
    for (b, body) in mechanism.bodies().iter().enumerate() {
        let reach = mechanism
            .bodies()
            .iter()
            .filter(|child| child.parent == Some(b))
            .map(|child| child.joint.placement.translation.norm())
            .fold(0.05, f64::max);
        let com = body.inertia.about_com().map_or(0.0, |(c, _)| c.norm());
        let size = reach.max(com);
        let mass = if masses[b] > 0.0 { masses[b] } else { 0.1 * mean };
        of_body.push(0.5 * mass * size * size);
        scales.push(0.5 * mass);
        scales.extend([0.5 * mass * size; 3]);
        scales.extend([0.5 * mass * size * size; 6]);
    }
    let owners = mechanism.rate_bodies();
    for parameter in &model.parameters().linear[scales.len()..] {
        let body = model
            .joints()
            .iter()
            .position(|j| matches!(&parameter.owner, dynid_model::Owner::Joint(n) if *n == j.name))
            .map_or(0, |rate| owners[rate]);
        // Only rotor inertias share a base parameter with links; the scale of the others has no effect.
        scales.push(of_body[body].max(1e-3));
    }
    scales
}

fn row_rms(groups: &[ReducedGroup], x: &[f64], columns: usize) -> Vec<Option<f64>> {
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    (0..outputs)
        .map(|output| {
            let (mut rss, mut rows) = (0.0, 0);
            for group in groups.iter().filter(|g| g.output == output) {
                rss += group.merged(columns).rss(x);
                rows += group.rows();
            }
            (rows > 0).then(|| (rss / rows as f64).sqrt())
        })
        .collect()
}

fn residual_ratios(
    groups: &[ReducedGroup],
    fit: &WlsEstimate,
    logs: &[PreparedLog],
    kernel_hz: f64,
) -> Vec<Option<f64>> {
    let outputs = groups.iter().map(|g| g.output + 1).max().unwrap_or(0);
    let spread = 0.265 / kernel_hz;
    (0..outputs)
        .map(|output| {
            let (mut found, mut expected) = (0.0, 0.0);
            for (k, group) in groups.iter().enumerate() {
                if group.output != output || group.scale != 0 || fit.groups.len() != groups.len() {
                    continue;
                }
                let log = &logs[group.log];
                let noise = log.effort_noise[output].sigma;
                let passed = 1.0 / (2.0 * std::f64::consts::PI.sqrt() * spread * log.rate_hz);
                let rows = group.rows() as f64;
                found += rows * fit.groups[k].variance;
                expected += rows * noise * noise * passed;
            }
            // A pre-smoothed effort has no noise floor to compare with.
            (expected > 1e-10 * found && found > 0.0).then(|| (found / expected).sqrt())
        })
        .collect()
}

/// Sample rate below which a log of a robot is suspected of another unit of time, Hz.
const SLOWEST_HZ: f64 = 10.0;

fn log_warnings(model: &RobotModel, logs: &[PreparedLog]) -> Vec<String> {
    let mut out = Vec::new();
    for log in logs {
        let name =
            Path::new(&log.name).file_name().map_or_else(|| log.name.clone(), |n| n.to_string_lossy().into());
        if log.rate_hz < SLOWEST_HZ {
            out.push(format!(
                "{name}: a sample rate of {} Hz: if the time column is in milliseconds, say so (unit \"ms\"), or state `rate_hz`",
                log.rate_hz
            ));
        }
        if log.clock.dropped > 0 {
            out.push(format!(
                "{name}: {} rows dropped because their time does not advance (first: row {})",
                log.clock.dropped,
                log.clock.first_dropped.unwrap_or(0) + 1
            ));
        }
        if !log.clock.gaps.is_empty() {
            out.push(format!(
                "{name}: {} gaps in the clock, {} grid samples unusable",
                log.clock.gaps.len(),
                log.clock.unusable
            ));
        }
        for (output, moves) in log.moves.iter().enumerate() {
            if !moves {
                out.push(format!("{name}: joint `{}` does not move", model.outputs()[output].name));
            }
        }
    }
    out
}
