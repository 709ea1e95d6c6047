//! From robot and configuration to a design problem.

use std::sync::Arc;

use dynid_config::nominal::{nominal_parameters, typical_efforts, with_nominal_shape};
use dynid_excitation::constraint::ConstraintError;
use dynid_excitation::criterion::{Criterion, Measure};
use dynid_excitation::{
    ColumnInfo, DEFAULT_SAMPLES_PER_HARMONIC, DEFAULT_SIGN_WIDTH, ExcitationModel, Information, MotionLimits,
    Problem, RobotExcitation, StartConditions, information,
};
use dynid_files::SourceFile;
use dynid_identify::Error;
use dynid_identify::elements::ElementPlan;
use dynid_identify::robot::Robot;
use dynid_identify::settings::known;
use dynid_logs::TrajectoryFile;
use dynid_model::{BaseParameters, BaseSettings, ClosedModel, EffortModel, RobotModel, TreeModel};
use dynid_motion::trajectory::{Form, RowOrder};

use super::DesignError;
use super::config::{ColumnsName, CriterionName, DesignConfig};
use super::limits::{Kept, constraints, effort_limits, joint_limits};
use super::loops;
use super::safety::Safety;

/// A nominal base parameter below this share of the largest of the same unit counts as so large: relative errors of what
/// is next to nothing are not worth motion.
pub(super) const FLOOR_SHARE: f64 = 0.05;
/// Noise of an effort that nothing is said about, as a share of its limit or of the largest nominal effort.
const NOISE_SHARE: f64 = 0.01;

/// A design problem of a robot, and what was taken for granted in it.
pub(super) struct RobotProblem {
    pub(super) problem: Problem,
    pub(super) model: Arc<RobotModel>,
    /// Poses of all joints, of mechanisms with loops.
    pub(super) poses: Option<Arc<ClosedModel>>,
    /// Nominal values of all parameters; `None` if the robot file states no inertias.
    pub(super) nominal: Option<Vec<f64>>,
    pub(super) criterion: CriterionName,
    /// Standard deviation of the noise, per joint.
    pub(super) noise: Vec<f64>,
    /// Effort limits, per joint.
    pub(super) effort_limits: Vec<Option<f64>>,
    /// What was taken for granted, in words.
    pub(super) assumptions: Vec<String>,
    /// What is kept by default.
    pub(super) safety: Safety,
    /// Trajectory files of earlier experiments, as they were read.
    pub(super) earlier: Vec<SourceFile>,
}

pub(super) fn pose(problem: &RobotProblem, config: &DesignConfig) -> Result<Option<Vec<f64>>, Error> {
    let Some(parking) = &config.trajectory.parking else { return Ok(None) };
    let joints = &problem.problem.coordinates;
    for joint in parking.keys() {
        known(joint, joints)?;
    }
    let at = |(joint, limits): (&String, &MotionLimits)| match parking.get(joint) {
        Some(x) if !(*x >= limits.position.0 && *x <= limits.position.1) => Err(Error::setting(
            &format!("trajectory.parking.{joint}"),
            &format!("{} to {}, the joint's limits", limits.position.0, limits.position.1),
            x,
        )),
        Some(x) => Ok(*x),
        None => Ok(f64::NAN),
    };
    let stated: Vec<f64> = joints.iter().zip(&problem.problem.limits).map(at).collect::<Result<_, _>>()?;
    let home = problem.poses.as_ref().map_or_else(Vec::new, |poses| poses.machine().home_independent());
    let or_home = |(k, x): (usize, f64)| match x.is_nan() {
        true => {
            let (low, high) = problem.problem.limits[k].position;
            home.get(k).copied().unwrap_or(0.0).clamp(low, high)
        }
        false => x,
    };
    Ok(Some(stated.into_iter().enumerate().map(or_home).collect()))
}

/// Refuses elastic joints: positions of motors depend on the efforts that the design is to find parameters of.
fn refuse_springs(robot: &Robot) -> Result<(), Error> {
    match robot.elements.elastic.first() {
        None => Ok(()),
        Some(e) => Err(Error::Unsupported(format!(
            "joint `{}` is elastic: its motor goes where the torque of its spring puts it, so the motor's acceleration needs the motion of the links \
             with four time derivatives, and designs have joint trajectories with two: design with the robot file without `elastic`, and \
             try the motion by `dynid simulate`",
            e.joint
        ))),
    }
}

/// The model that a design is for.
pub(super) struct Subject {
    pub(super) model: Arc<RobotModel>,
    /// Values of all its parameters; `None` if nothing states inertias.
    pub(super) nominal: Option<Vec<f64>>,
    /// Parameters that are to become visible.
    pub(super) excitation: Box<dyn ExcitationModel>,
    /// Standard deviations of the outputs' noise, where they are known from logs.
    pub(super) noise: Option<Vec<f64>>,
}

/// Refuses robots that no joint trajectory is designed for.
pub(super) fn refuse(robot: &Robot) -> Result<(), Error> {
    let mechanism = &robot.mechanism;
    if mechanism.positions() != mechanism.rates() {
        return Err(Error::Unsupported(
            "a floating base follows no joint trajectory: design for the arm alone".to_owned(),
        ));
    }
    refuse_springs(robot)
}

/// The model of the robot file and of the elements of a configuration, and its columns.
fn subject(robot: &Robot, config: &DesignConfig) -> Result<(Subject, RobotExcitation), Error> {
    let mechanism = &robot.mechanism;
    let all = mechanism.rate_names();
    let mut elements = robot.elements.with_ideal_bearings();
    for (joint, list) in &config.elements.joint {
        known(joint, &all)?;
        elements.per_joint.retain(|(j, _)| j != joint);
        elements.per_joint.push((joint.clone(), list.clone()));
    }
    if let Some(file) = &config.elements.known_friction {
        return Err(Error::setting(
            "elements.known_friction",
            "a design without known friction, which changes no column of the regressor",
            file.display(),
        ));
    }
    let default = config.elements.default.as_deref();
    let plan = ElementPlan::new(mechanism, &elements, default, |rate| robot.is_driven(rate))?
        .with_loops(robot.closed.clone())
        .in_steady_motion();
    let model = plan.tied_model(mechanism)?;
    let model = Arc::new(with_nominal_shape(model, &plan, &config.values)?);
    let nominal = match mechanism.bodies().iter().any(|b| b.stated) {
        true => Some(nominal_parameters(&model, &plan, &config.values)?),
        false => None,
    };
    let excitation = columns(config, &model, nominal.as_deref());
    Ok((Subject { excitation: Box::new(excitation.clone()), model, nominal, noise: None }, excitation))
}

/// The problem of a design from a robot file.
pub(super) fn problem(robot: &Robot, config: &DesignConfig) -> Result<RobotProblem, Error> {
    refuse(robot)?;
    let (subject, excitation) = subject(robot, config)?;
    let name = match config.criterion.name {
        Some(CriterionName::RelativeStd) if subject.nominal.is_none() => {
            return Err(Error::setting(
                "criterion.name",
                "a criterion without nominal parameters: the robot file states no inertias",
                "relative-std",
            ));
        }
        Some(name) => name,
        None if subject.nominal.is_some() => CriterionName::RelativeStd,
        None => CriterionName::UnitCondition,
    };
    let criterion = criterion(name, config, excitation.columns())?;
    let mut set = problem_of(robot, config, subject, name, criterion)?;
    let spacing = config.criterion.correlation_time_s.max(1.0 / config.form().sample_rate_hz);
    set.problem.prior = earlier(config, &set.problem, &excitation, spacing, &mut set.earlier)?;
    Ok(set)
}

/// The problem of a design for a model of a robot.
pub(super) fn problem_of(
    robot: &Robot,
    config: &DesignConfig,
    subject: Subject,
    name: CriterionName,
    criterion: Criterion,
) -> Result<RobotProblem, Error> {
    let Subject { model, nominal, excitation, noise: of_logs } = subject;
    let poses = loops::poses(robot)?;
    if let (None, Some(x)) = (&poses, config.limits.singularity) {
        return Err(Error::setting("limits.singularity", "a mechanism with loops, which it is for", x));
    }
    let mechanism = &robot.mechanism;
    let all = mechanism.rate_names();
    let joints: Vec<String> = loops::coordinates(robot).into_iter().map(|rate| all[rate].clone()).collect();
    if !model.channels().is_empty() {
        return Err(Error::Unsupported(
            "elements that read channels such as currents say nothing about motion: leave them out of a design"
                .to_owned(),
        ));
    }
    for frame in &config.trajectory.frames {
        mechanism.frame(frame).map_err(ConstraintError::from).map_err(DesignError::from)?;
    }
    let mut assumptions = Vec::new();
    if nominal.is_none() {
        assumptions.push(
            "the robot file states no inertias: efforts and relative standard deviations are unknown"
                .to_owned(),
        );
    }
    let limits = joint_limits(robot, config, &joints, &mut assumptions)?;
    let effort_limits = effort_limits(robot, config, &joints)?;
    let kept = Kept { limits: &limits, effort_limits: &effort_limits, poses: poses.as_ref() };
    let (constraints, safety) =
        constraints(robot, config, &model, nominal.as_deref(), &kept, &mut assumptions)?;
    let typical = nominal.as_ref().map(|n| typical_efforts(&model, n));
    let noise = match of_logs {
        Some(noise) => noise,
        None => noise(config, &joints, &effort_limits, typical.as_deref(), &mut assumptions)?,
    };
    let form = config.form();
    let spacing = config.criterion.correlation_time_s.max(1.0 / form.sample_rate_hz);
    let problem = Problem {
        criterion,
        coordinates: joints.clone(),
        limits,
        constraints,
        base: std::f64::consts::TAU / form.period_s,
        harmonics: form.harmonics,
        start: start_conditions(config, &joints)?,
        output_weights: noise.iter().map(|s| 1.0 / s).collect(),
        effective_samples: config.trajectory.periods as f64 * form.period_s / spacing,
        prior: None,
        sign_width: DEFAULT_SIGN_WIDTH,
        samples: DEFAULT_SAMPLES_PER_HARMONIC * form.harmonics,
        model: excitation,
    };
    Ok(RobotProblem {
        problem,
        model,
        poses,
        nominal,
        criterion: name,
        noise,
        effort_limits,
        assumptions,
        safety,
        earlier: Vec::new(),
    })
}

fn start_conditions(config: &DesignConfig, joints: &[String]) -> Result<StartConditions, Error> {
    let t = &config.trajectory;
    for joint in t.start_pose.keys() {
        known(joint, joints)?;
    }
    let pose = if t.start_pose.is_empty() {
        None
    } else {
        let at = |joint: &String| {
            let x = t.start_pose.get(joint).copied().filter(|x| x.is_finite());
            x.ok_or_else(|| {
                Error::setting("trajectory.start_pose", &format!("a position of joint `{joint}`"), "none")
            })
        };
        Some(joints.iter().map(at).collect::<Result<_, _>>()?)
    };
    Ok(StartConditions { rest: t.rest, zero_jerk: t.zero_jerk, pose })
}

fn noise(
    config: &DesignConfig,
    joints: &[String],
    effort_limits: &[Option<f64>],
    typical: Option<&[f64]>,
    assumptions: &mut Vec<String>,
) -> Result<Vec<f64>, Error> {
    let given = config.criterion.noise.positive("criterion.noise", joints)?;
    if given.iter().any(Option::is_none) {
        assumptions.push(format!(
            "noise of the effort is not stated for {}: {} % of the effort limit (of the largest nominal effort where \
             there is no limit) is used",
            joints.iter().zip(&given).filter(|(_, g)| g.is_none()).map(|(j, _)| j.as_str()).collect::<Vec<_>>().join(", "),
            100.0 * NOISE_SHARE
        ));
    }
    let guess = |k: usize| {
        let size = effort_limits[k].or_else(|| typical.map(|t| t[k])).filter(|x| *x > 0.0);
        size.map_or(1.0, |x| NOISE_SHARE * x)
    };
    Ok(given.into_iter().enumerate().map(|(k, g)| g.unwrap_or_else(|| guess(k))).collect())
}

fn columns(config: &DesignConfig, model: &Arc<RobotModel>, nominal: Option<&[f64]>) -> RobotExcitation {
    let shape = model.parameters().shape_start();
    let base = BaseParameters::of_model(model.as_ref(), &shape, &BaseSettings::default());
    match config.criterion.columns {
        ColumnsName::All => RobotExcitation::new(model.clone(), shape, &base, nominal),
        ColumnsName::Inertial => {
            let tree = TreeModel::new(model.mechanism().clone(), Vec::new());
            let rigid = match model.closed() {
                Some(closed) => ClosedModel::new(tree, closed.machine().clone()).into(),
                None => RobotModel::from(tree),
            };
            let rigid = Arc::new(rigid);
            let base = BaseParameters::of_model(rigid.as_ref(), &[], &BaseSettings::default());
            let links = rigid.parameters().linear.len();
            RobotExcitation::new(rigid, Vec::new(), &base, nominal.map(|n| &n[..links]))
        }
    }
}

pub(super) fn criterion(
    name: CriterionName,
    config: &DesignConfig,
    columns: &[ColumnInfo],
) -> Result<Criterion, Error> {
    Ok(match name {
        CriterionName::RelativeStd => {
            let size = |k: usize| columns[k].nominal.map_or(0.0, f64::abs);
            let weights = (0..columns.len())
                .map(|k| {
                    let alike = (0..columns.len()).filter(|j| columns[*j].unit == columns[k].unit).map(size);
                    let floor = FLOOR_SHARE * alike.fold(0.0, f64::max);
                    match size(k).max(floor) {
                        0.0 => 1.0,
                        x => 1.0 / (x * x),
                    }
                })
                .collect();
            Criterion::raw(Measure::Trace(weights))
        }
        CriterionName::UnitCondition => Criterion::unit_norm(Measure::Condition),
        CriterionName::Condition => Criterion::raw(Measure::Condition),
        CriterionName::Mix => {
            let [condition, smallest] = config.criterion.mix;
            Criterion::raw(Measure::ConditionAndSmallest { condition, smallest })
        }
        CriterionName::A => Criterion::raw(Measure::Trace(vec![1.0; columns.len()])),
        CriterionName::D => Criterion::raw(Measure::Determinant),
        CriterionName::E => Criterion::raw(Measure::Smallest),
        CriterionName::Intervals => {
            let expected = "another criterion: `dynid next` designs for intervals that are wanted";
            return Err(Error::setting("criterion.name", expected, "intervals"));
        }
    })
}

/// Information of earlier trajectories, stacked.
fn earlier(
    config: &DesignConfig,
    problem: &Problem,
    model: &RobotExcitation,
    spacing: f64,
    files: &mut Vec<SourceFile>,
) -> Result<Option<Information>, Error> {
    let mut stacked: Option<Information> = None;
    for path in &config.earlier {
        let (file, source) = TrajectoryFile::read_source(path)?;
        files.push(source);
        let order = file.order_of(&problem.coordinates).map_err(|joint| Error::InFile {
            file: path.display().to_string(),
            source: Box::new(Error::setting("joints", &format!("a trajectory of joint `{joint}`"), "none")),
        })?;
        let rows = file.motion.to_rows(Form::Plain, &RowOrder::default())?;
        let harmonics = rows.first().map_or(0, |r| (r.len() - 1) / 2);
        let earlier = Problem {
            model: Box::new(model.clone()),
            coordinates: problem.coordinates.clone(),
            limits: problem.limits.clone(),
            constraints: Vec::new(),
            base: file.motion.base(),
            harmonics,
            start: StartConditions::default(),
            criterion: problem.criterion.clone(),
            output_weights: problem.output_weights.clone(),
            effective_samples: file.motion.periods() as f64 * file.motion.period() / spacing,
            prior: stacked.take(),
            sign_width: problem.sign_width,
            samples: problem.samples,
        };
        let coefficients: Vec<Vec<f64>> = order.iter().map(|k| rows[*k].clone()).collect();
        stacked = Some(information(&earlier, &coefficients, 1000.max(20 * harmonics)));
    }
    Ok(stacked)
}
