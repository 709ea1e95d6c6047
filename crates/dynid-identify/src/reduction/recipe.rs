//! What decides the rows of a log: everything that an identification chose, so that other logs of the robot are reduced alike.

use std::collections::BTreeMap;
use std::path::Path;

use dynid_estimate::consistent::Bound;
use dynid_factor::groups::ReducedGroup;
use dynid_model::inertia::PARAMETER_NAMES;
use dynid_model::{EffortModel, Owner, Parameter, RobotModel};
use dynid_motion::cutoff::KernelLimit;
use dynid_rows::conditioning::{Conditioning, DelayEstimate, most_blocks, prediction_hz_of, state_hz_of};
use serde::{Deserialize, Serialize};

use super::columns::{Column, Output};
use super::shapes::Shapes;
use super::springs::Springs;
use super::{ReductionError, plain};
use crate::Error;
use crate::check::{CheckName, CheckResult};
use crate::estimate::{ElasticRecord, InputKind, InputRecord, ModelRecord, ReadingRecord};
use crate::friction_power::FrictionPower;
use crate::identification::Identification;
use crate::passivity::velocities;
use crate::problem::Problem;
use crate::robot::Robot;
use crate::settings::{ConditioningConfig, EstimatorConfig, Method, Preflight, Route, Settings};
use crate::shape::ShapeFit;
use crate::structure::Structure;
use crate::training_log::TrainingLog;
use crate::verdict::{self, Status};

/// Symbol of the rest of a delay.
pub const DELAY: &str = "delay";

/// What decides the rows of a log, and how factors of such rows are solved.
///
/// It comes from an identification ([`Identification::recipe`]) on logs that stand for all others: kernel, mask, delay, shapes of
/// friction and the point about which they are linearised, length of the time blocks, size of the efforts behind the prior, and the speeds at
/// which friction must not drive are those of these logs.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Recipe {
    /// Robot.
    pub robot: String,
    /// The robot, its elements and shapes.
    pub model: ModelRecord,
    /// Largest speed and effort of joints, where the robot file states them.
    limits: Vec<JointLimit>,
    /// Efforts, in the order of the rows.
    pub outputs: Vec<Output>,
    /// Columns of the factors: base parameters of the model, changes of shape parameters among them.
    pub columns: Vec<Column>,
    /// Shape parameters and the point about which the model is linear; absent where there are none.
    shapes: Option<Shapes>,
    /// Values of the robot file, in parameter order.
    stated: Vec<Option<f64>>,
    /// Per output: 99 % of the efforts are smaller, N m or N.
    effort_sizes: Vec<f64>,
    /// Per output: least and greatest velocity of the logs, rad/s or m/s; absent where none moves it.
    pub velocities: Vec<Option<(f64, f64)>>,
    /// Choices of the conditioning.
    pub choices: Choices,
    /// Time blocks.
    pub blocks: Blocks,
    /// What a consistent estimate must meet.
    bounds: Vec<BoundRecord>,
    /// Parameters that have no limit of their own beside these.
    free: Vec<String>,
    /// Whether errors of known friction may have any sign.
    free_errors: bool,
    /// Settings that were asked for.
    settings: Asked,
    /// Files of the robot, and of friction that is known.
    pub inputs: Vec<InputRecord>,
    /// How logs are read.
    pub reading: ReadingRecord,
    /// Whether factors have a column per output for the rest of its delay, behind the others.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    delays: bool,
    /// Link whose parameters are columns of their own, since every log may carry something else on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    payload: Option<String>,
    /// Joints with encoders on both sides of their gears: read at their motors, their deformations outputs of their own behind those of the model.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springs: Option<Springs>,
    /// Checks of the identification behind it that did not pass and that factors cannot repeat.
    pub doubts: Vec<CheckResult>,
}

/// Largest speed and effort of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct JointLimit {
    joint: String,
    velocity: Option<f64>,
    effort: Option<f64>,
}

/// Choices of the conditioning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Choices {
    /// Cut-off of the widest kernel, Hz.
    pub kernel_hz: f64,
    /// Cut-offs of all kernels, widest first, Hz.
    pub scales_hz: Vec<f64>,
    /// Highest kernel that noise and band allow, Hz.
    limit_hz: f64,
    /// Frequency at which the noise of the positions reaches their spectrum, Hz.
    crossing_hz: f64,
    /// Cut-off above which noise begins to show in the velocity, Hz; 0 in files of before that was known.
    #[serde(default)]
    velocity_hz: f64,
    /// Band of the motion, Hz.
    band_hz: f64,
    /// Delay of the motion behind the logged effort, samples.
    pub delay_samples: f64,
    /// Half width of its 95 % interval, samples.
    delay_half_width: f64,
    /// Sample rate at which the delay was found, Hz.
    pub rate_hz: f64,
    /// Per output: rung of the mask ladder, 0 = no mask.
    rung: Vec<usize>,
    /// Per output: mask as a share of the rms speed; absent: no mask.
    pub mask: Vec<Option<f64>>,
    /// Per output: share of samples that stay usable.
    usable: Vec<f64>,
    /// Per output: rms speed in the log in which it is greatest, rad/s or m/s; empty in files of before that was told.
    #[serde(default)]
    pub(super) rms_speed: Vec<f64>,
}

/// Time blocks behind standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Blocks {
    /// Most time blocks of a log.
    pub most: usize,
    /// How many of them make one.
    pub merged: usize,
    /// Length that the residuals asked for, s.
    pub wanted_s: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct BoundRecord {
    name: String,
    terms: Vec<(usize, f64)>,
    upper: f64,
}

/// Settings that a recipe keeps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Asked {
    seed: Option<u64>,
    preferred: Vec<String>,
    conditioning: ConditioningConfig,
    estimator: EstimatorConfig,
    known_effort_scale: bool,
    known_mass: BTreeMap<String, f64>,
    preflight: Preflight,
}

impl Identification {
    /// What decides the rows of other logs as it decided those of these.
    ///
    /// # Errors
    /// [`Error::Unsupported`] for what no factor of single logs holds: the textbook route, robust losses and instruments, which look at
    /// single rows; terms of single logs; elastic joints that were not taken as stiff ones ([`Settings::stiff_joints`]).
    pub fn recipe(&self) -> Result<Recipe, Error> {
        let Some(found) =
            self.conditioning.as_ref().filter(|_| self.settings.conditioning.route != Route::Textbook)
        else {
            return Err(not_reduced("the textbook route", "leave out `route`"));
        };
        match self.settings.estimator.method {
            Method::Huber | Method::Tukey | Method::Iv | Method::Didim | Method::Cloe => {
                return Err(not_reduced(
                    "estimators that look at single rows",
                    "take `method = \"wls\"`, the default",
                ));
            }
            Method::Ols | Method::Wls | Method::Ridge | Method::Tls => {}
        }
        if self.settings.own_estimator.is_some() {
            return Err(not_reduced(
                "the choice of an own estimator",
                "learn by weighted least squares, and solve as you like",
            ));
        }
        if self.settings.closed_loop.is_some() {
            return Err(not_reduced("`[instruments]`", "leave the table out"));
        }
        if self.settings.estimator.search.is_some() {
            return Err(not_reduced(
                "`[estimator.search]`, whose losses are those of samples,",
                "leave the table out",
            ));
        }
        if !self.plan.log_terms.is_empty() || !self.own_delays.is_empty() {
            return Err(not_reduced("terms of single logs", "leave out `payload` and `own`"));
        }
        if !self.plan.elastic.is_empty() && !self.plan.is_measured() {
            return Err(not_reduced(
                "rows of elastic joints",
                "take them as stiff ones by `stiff_joints = true`, as `dynid reduce` does by itself",
            ));
        }
        if self.loads.is_some() {
            let instead = "identify from the logs, or state other friction and `clearance = \"ideal\"` under `[elements]`";
            return Err(not_reduced(
                "friction that follows reactions, and journals in bearings, whose rows go with the estimate,",
                instead,
            ));
        }
        let table = self.model.parameters();
        let mut model = ModelRecord::new(&self.robot.file.description, &self.robot.mechanism, &self.plan);
        (model.state_hz, model.kernel_hz) = (self.state_hz, self.kernel_hz);
        let limit = |j: &dynid_model::JointDescription| {
            let dynid_model::Limits { velocity, effort, .. } = j.limits;
            (velocity.is_some() || effort.is_some()).then(|| JointLimit {
                joint: j.name.clone(),
                velocity,
                effort,
            })
        };
        let column = |(c, scale): (&usize, &f64)| {
            let p = &table.linear[*c];
            Column { name: p.name.clone(), unit: p.unit.to_owned(), scale: *scale }
        };
        let output = |o: &dynid_model::Output| Output { name: o.name.clone(), unit: o.unit.to_owned() };
        let bound = |b: &Bound| {
            let Bound { name, terms, upper } = b.clone();
            BoundRecord { name, terms, upper }
        };
        Ok(Recipe {
            robot: self.model.mechanism().name().to_owned(),
            limits: self.robot.file.description.joints.iter().filter_map(limit).collect(),
            outputs: self.model.outputs().iter().map(output).collect(),
            columns: self.base.kept.iter().zip(&self.base_scales).map(column).collect(),
            shapes: self.shapes.as_ref().map(Shapes::of),
            stated: self.stated.clone(),
            effort_sizes: self.effort_sizes.clone(),
            velocities: (0..self.model.outputs().len()).map(|j| velocities(&self.trained, j)).collect(),
            choices: Choices::of(found, self.delay_rate_hz),
            blocks: Blocks {
                most: most_blocks(self.trained.len()),
                merged: self.fitted.merged_blocks,
                wanted_s: self.fitted.block_length.seconds,
            },
            bounds: self.bounds.iter().map(bound).collect(),
            free: self.power.kept.clone(),
            free_errors: self.plan.free_errors,
            settings: Asked::of(&self.settings),
            inputs: self
                .robot
                .inputs()
                .into_iter()
                .chain(
                    self.plan.known_source.iter().map(|source| InputRecord::of(InputKind::Friction, source)),
                )
                .collect(),
            reading: ReadingRecord::default(),
            delays: false,
            payload: None,
            springs: Springs::of(self)?,
            doubts: doubts(self),
            model,
        })
    }
}

/// Checks that look at samples, or at choices that a recipe keeps, and that did not pass.
fn doubts(id: &Identification) -> Vec<CheckResult> {
    let kept = [
        CheckName::Delay,
        CheckName::ReversalMask,
        CheckName::OwnLogs,
        CheckName::TrainingFit,
        CheckName::ValidationFit,
    ];
    let verdict = verdict::judge(id);
    let is_doubt = |c: &CheckResult| c.status != Status::Ok && kept.contains(&c.name);
    verdict.checks.into_iter().filter(is_doubt).collect()
}

/// Refuses what is no moving link of a robot.
///
/// # Errors
/// [`Error::Setting`] with the links that there are.
pub fn check_payload_link(robot: &Robot, link: &str) -> Result<(), Error> {
    let names: Vec<&str> = robot.mechanism.bodies().iter().map(|body| body.name.as_str()).collect();
    match names.contains(&link) {
        true => Ok(()),
        false => {
            Err(Error::setting("payload.link", &format!("a moving link: `{}`", names.join("`, `")), link))
        }
    }
}

/// Names of the parameters of a link, which what it carries adds to.
pub fn payload_columns(link: &str) -> Vec<String> {
    PARAMETER_NAMES.iter().map(|symbol| format!("{link}.{symbol}")).collect()
}

fn not_reduced(what: &str, instead: &str) -> Error {
    Error::Unsupported(format!("{what} cannot be reduced to factors: {instead}"))
}

impl Recipe {
    /// SHA-256 of everything that decides rows and their solution, hexadecimal; not of where files lie: factors of the same rows go together.
    pub fn hash(&self) -> String {
        let without_paths = Recipe {
            inputs: self.inputs.iter().map(|i| InputRecord { path: String::new(), ..i.clone() }).collect(),
            reading: ReadingRecord::default(),
            doubts: Vec::new(),
            ..self.clone()
        };
        dynid_files::digest::sha256(plain(&without_paths).as_bytes())
    }

    /// Returns the recipe with a column per output for the rest of its delay, log by log: a fleet then sees how delays differ and change, and a
    /// solution no longer rests on the one delay of the recipe.
    #[must_use]
    pub fn with_delays(self) -> Self {
        Recipe { delays: true, ..self }
    }

    /// Whether factors have columns for the rest of delays.
    pub fn has_delays(&self) -> bool {
        self.delays
    }

    /// Returns the recipe for logs each of which may carry a body of its own on a link: a fleet then takes the parameters of the link for different in
    /// every log.
    ///
    /// What a link carries acts as the link does, so that no column is added; the columns of the link have to be columns of the recipe by
    /// themselves, which they are where the identification was asked to keep them ([`payload_columns`], the setting `preferred`).
    ///
    /// # Errors
    /// [`Error::Setting`] for what is no moving link, and for an identification that did not keep its columns.
    pub fn with_payload(self, link: &str) -> Result<Self, Error> {
        let (problem, _) = self.problem()?;
        check_payload_link(&problem.robot, link)?;
        let wanted = payload_columns(link);
        match wanted.iter().all(|name| self.settings.preferred.contains(name)) {
            true => Ok(Recipe { payload: Some(link.to_owned()), ..self }),
            false => {
                Err(Error::setting("preferred", &format!("`{}`", wanted.join("`, `")), "not all of them"))
            }
        }
    }

    /// The blocks of a group as its factors have them. Of logs that may differ in what they carry there are two at least: no residual shows how far
    /// what a log tells of that scatters, halves of logs do.
    pub(super) fn coarsened(&self, group: &ReducedGroup) -> ReducedGroup {
        let merged = match self.payload {
            Some(_) => self.blocks.merged.min((group.blocks.len() / 2).max(1)),
            None => self.blocks.merged,
        };
        group.coarsened(merged)
    }

    /// The link on which every log may carry something else.
    pub fn payload(&self) -> Option<&str> {
        self.payload.as_deref()
    }

    /// Columns of factors: [`Recipe::columns`], and where they have them those of the rest of delays, a sample in size, and those of deformations.
    pub fn all_columns(&self) -> Vec<Column> {
        let delay = |output: &Output| Column {
            name: format!("{}.{DELAY}", output.name),
            unit: "s".to_owned(),
            scale: 1.0 / self.choices.rate_hz,
        };
        let delays = self.outputs.iter().filter(|_| self.delays).map(delay);
        let springs = self.springs.iter().flat_map(Springs::columns).cloned();
        self.columns.iter().cloned().chain(delays).chain(springs).collect()
    }

    /// Columns of the rows of efforts: those behind them are of deformations.
    pub(super) fn columns_of_efforts(&self) -> usize {
        self.columns.len() + if self.delays { self.outputs.len() } else { 0 }
    }

    /// What shares a variance of its noise in a log: a name, and the cut-off of the kernel, Hz, absent for deformations. Every output with every kernel,
    /// then the deformations.
    pub fn channels(&self) -> Vec<(String, Option<f64>)> {
        let of_output = |output: &Output| {
            let name = output.name.clone();
            self.choices.scales_hz.iter().map(move |hz| (name.clone(), Some(*hz))).collect::<Vec<_>>()
        };
        let springs = self.springs.iter().flat_map(|springs| &springs.joints);
        let deformations = springs.map(|spring| (format!("deformation of {}", spring.elastic.joint), None));
        self.outputs.iter().flat_map(of_output).chain(deformations).collect()
    }

    /// Place of a group among [`Recipe::channels`].
    pub fn channel(&self, group: &ReducedGroup) -> usize {
        let (outputs, scales) = (self.outputs.len(), self.choices.scales_hz.len());
        match group.output.checked_sub(outputs) {
            None => group.output * scales + group.scale,
            Some(deformation) => outputs * scales + deformation,
        }
    }

    /// The joint whose deformation a column of factors is of, as a place among [`Springs::joints`]; `None` for columns of efforts.
    pub fn deformation_of(&self, column: usize) -> Option<usize> {
        let mut behind = column.checked_sub(self.columns_of_efforts())?;
        self.springs.as_ref()?.joints.iter().position(|spring| {
            match behind.checked_sub(spring.columns.len()) {
                None => true,
                Some(rest) => {
                    behind = rest;
                    false
                }
            }
        })
    }

    /// Whether there may be a group of this output and kernel.
    pub(super) fn has_group(&self, output: usize, scale: usize) -> bool {
        let deformations = self.springs.as_ref().map_or(0, |springs| springs.joints.len());
        match output < self.outputs.len() {
            true => scale < self.choices.scales_hz.len(),
            false => output < self.outputs.len() + deformations && scale == 0,
        }
    }

    /// Per column of factors ([`Recipe::all_columns`]) the parameter that stands for it.
    ///
    /// # Errors
    /// [`ReductionError::Contradiction`].
    pub fn parameters(&self) -> Result<Vec<Parameter>, Error> {
        let (problem, _) = self.problem()?;
        let table = &problem.model.parameters().linear;
        let delay = |(k, output): (usize, &Output)| Parameter {
            name: format!("{}.{DELAY}", output.name),
            symbol: format!("{DELAY}{}", k + 1),
            unit: "s",
            owner: Owner::Joint(output.name.clone()),
            prior: None,
            lower: None,
            upper: None,
            fold_first: false,
        };
        let delays = self.outputs.iter().enumerate().filter(|_| self.delays).map(delay);
        let springs = self.springs.iter().flat_map(Springs::parameters);
        let of_base = problem.structure.base.kept.iter().map(|c| table[*c].clone());
        Ok(of_base.chain(delays).chain(springs).collect())
    }

    /// Returns the recipe with how its logs were read, for other logs to be read alike.
    #[must_use]
    pub fn with_reading(self, reading: ReadingRecord) -> Self {
        Recipe { reading, ..self }
    }

    /// Returns the recipe without the look at logs before they are reduced, for logs that were made by the model itself.
    #[must_use]
    pub fn without_preflight(mut self) -> Self {
        self.settings.preflight = Preflight::Off;
        self
    }

    /// The problem without logs: robot, elements, model, what is known before a fit.
    ///
    /// # Errors
    /// [`ReductionError::Contradiction`]: the recipe is not one that this version would have written.
    pub(super) fn problem(&self) -> Result<(Problem, Solved), Error> {
        let contradiction = |what: String| Error::from(ReductionError::Contradiction { what });
        let mut file = self.model.robot_file(&self.robot).map_err(contradiction)?;
        for limit in &self.limits {
            let joint = file.description.joints.iter_mut().find(|j| j.name == limit.joint);
            let joint =
                joint.ok_or_else(|| contradiction(format!("limits of `{}`, no joint", limit.joint)))?;
            (joint.limits.velocity, joint.limits.effort) = (limit.velocity, limit.effort);
        }
        // Logs have columns for motors.
        file.elements.elastic =
            self.model.elastic.iter().map(ElasticRecord::spec).collect::<Result<_, _>>()?;
        let path = self.inputs.first().map_or_else(|| self.robot.clone(), |input| input.path.clone());
        let robot = Robot::of_parts(Path::new(&path), file)?;
        let mut plan = self.model.plan(&robot.mechanism)?.with_loops(robot.closed.clone());
        plan.free_errors = self.free_errors;
        if plan.per_rate.len() != plan.names(&robot.mechanism).len() {
            return Err(contradiction(
                "elements for another number of efforts than the robot has".to_owned(),
            ));
        }
        let nonlinear = plan.tied_model(&robot.mechanism)?;
        let (shapes, model) = match &self.shapes {
            None => (None, nonlinear),
            Some(shapes) => {
                let (found, model) = shapes.fit(&plan, nonlinear)?;
                (Some(found), model)
            }
        };
        let model = model.with_free_sign(|p| self.free.contains(&p.name));
        let settings = self.settings.settings();
        let rows = model.parameters().linear.len();
        let bounds: Vec<Bound> = self.bounds.iter().map(|b| b.bound(rows)).collect::<Result<_, _>>()?;
        if self.stated.len() != rows || self.effort_sizes.len() != model.outputs().len() {
            return Err(contradiction("values of the robot file for another model".to_owned()));
        }
        let structure =
            Structure::known(&settings, &robot, &model, &self.stated, &self.effort_sizes, bounds)?;
        self.check(&model, &structure)?;
        let power = FrictionPower::of_earlier(self.free.clone());
        let problem = Problem {
            robot,
            plan,
            model,
            structure,
            logs: Vec::new().into(),
            training: Vec::new(),
            settings,
        };
        Ok((problem, Solved { shapes, power }))
    }

    /// Outputs, columns and choices are those of the model that the recipe describes.
    fn check(&self, model: &RobotModel, structure: &Structure) -> Result<(), Error> {
        let table = &model.parameters().linear;
        let contradiction = |what: &str| Err(ReductionError::Contradiction { what: what.to_owned() }.into());
        if !self.outputs.iter().map(|o| &o.name).eq(model.outputs().iter().map(|o| &o.name)) {
            return contradiction("outputs of another robot");
        }
        if !self.columns.iter().map(|c| &c.name).eq(structure.base.kept.iter().map(|c| &table[*c].name)) {
            return contradiction("columns of another model, or of another version of the analysis");
        }
        let outputs = self.outputs.len();
        let Choices { kernel_hz, scales_hz, rung, mask, usable, rate_hz, delay_samples, .. } = &self.choices;
        let numbers = [*kernel_hz, *rate_hz].iter().chain(scales_hz).all(|x| x.is_finite() && *x > 0.0);
        let per_output =
            [rung.len(), mask.len(), usable.len(), self.velocities.len()].iter().all(|n| *n == outputs);
        let speeds = &self.choices.rms_speed;
        let speeds =
            speeds.is_empty() || speeds.len() == outputs && speeds.iter().all(|v| v.is_finite() && *v >= 0.0);
        let ladder = self.settings.settings().conditioning_settings().ladder.len();
        if !numbers
            || !per_output
            || !speeds
            || scales_hz.is_empty()
            || !delay_samples.is_finite()
            || delay_samples.abs() > 1e6
            || rung.iter().any(|r| *r > ladder)
        {
            return contradiction("choices that no conditioning makes");
        }
        if self.springs.as_ref().is_some_and(|springs| !springs.fit(&self.outputs)) {
            return contradiction("deformations of other joints, or of no number");
        }
        let Blocks { most, merged, wanted_s } = self.blocks;
        if most == 0 || merged == 0 || !wanted_s.is_finite() || wanted_s < 0.0 {
            return contradiction("time blocks of no length");
        }
        Ok(())
    }

    /// The choices for logs of given sample rates.
    pub(super) fn conditioning(&self, rates_hz: &[f64]) -> Conditioning {
        let c = &self.choices;
        let settings = self.settings.settings().conditioning_settings();
        let limit = KernelLimit {
            per_joint_hz: Vec::new(),
            crossing_hz: c.crossing_hz,
            velocity_hz: c.velocity_hz,
            excited_band_hz: c.band_hz,
            limit_hz: c.limit_hz,
        };
        let states = limit.states();
        Conditioning {
            limit,
            kernel_hz: c.kernel_hz,
            scales_hz: c.scales_hz.clone(),
            prediction_hz: prediction_hz_of(c.kernel_hz, states, rates_hz.iter().copied(), &settings),
            state_hz: rates_hz
                .iter()
                .map(|rate| state_hz_of(c.kernel_hz, states, *rate, &settings))
                .collect(),
            delay: DelayEstimate {
                samples: c.delay_samples,
                half_width: c.delay_half_width,
                per_output: Vec::new(),
                chi_squared: None,
                at_limit: false,
                given: true,
            },
            rung: c.rung.clone(),
            mask: c.mask.clone(),
            usable: c.usable.clone(),
            rms_speed: c.rms_speed.clone(),
            kernel_trials: Vec::new(),
            mask_trials: Vec::new(),
        }
    }
}

/// What a recipe knows of a fit beside its problem.
pub(super) struct Solved {
    pub(super) shapes: Option<ShapeFit>,
    pub(super) power: FrictionPower,
}

impl Choices {
    fn of(found: &Conditioning, rate_hz: f64) -> Self {
        Choices {
            kernel_hz: found.kernel_hz,
            scales_hz: found.scales_hz.clone(),
            limit_hz: found.limit.limit_hz,
            crossing_hz: found.limit.crossing_hz,
            velocity_hz: found.limit.velocity_hz,
            band_hz: found.limit.excited_band_hz,
            delay_samples: found.delay.samples,
            delay_half_width: found.delay.half_width,
            rate_hz,
            rung: found.rung.clone(),
            mask: found.mask.clone(),
            usable: found.usable.clone(),
            rms_speed: found.rms_speed.clone(),
        }
    }
}

impl BoundRecord {
    fn bound(&self, columns: usize) -> Result<Bound, Error> {
        let BoundRecord { name, terms, upper } = self.clone();
        match terms.iter().all(|(column, _)| *column < columns) {
            true => Ok(Bound { name, terms, upper }),
            false => {
                let what = format!("`{name}` bounds a parameter that the model does not have");
                Err(ReductionError::Contradiction { what }.into())
            }
        }
    }
}

impl Asked {
    fn of(settings: &Settings) -> Self {
        let Settings {
            seed,
            preferred,
            conditioning,
            estimator,
            known_effort_scale,
            known_mass,
            preflight,
            ..
        } = settings.clone();
        Asked { seed, preferred, conditioning, estimator, known_effort_scale, known_mass, preflight }
    }

    fn settings(&self) -> Settings {
        let Asked { seed, preferred, conditioning, estimator, known_effort_scale, known_mass, preflight } =
            self.clone();
        Settings::default().with(|s| {
            s.seed = seed;
            s.preferred = preferred;
            s.conditioning = conditioning;
            s.estimator = estimator;
            s.known_effort_scale = known_effort_scale;
            s.known_mass = known_mass;
            s.preflight = preflight;
        })
    }
}

/// The training log of a label, without what no recipe allows it.
pub(super) fn training_log(label: &str) -> TrainingLog {
    TrainingLog {
        label: label.to_owned(),
        settings: crate::settings::LogSettings::default(),
        reference: None,
    }
}
