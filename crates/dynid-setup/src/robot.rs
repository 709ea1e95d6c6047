//! From a robot file to a mechanism.

mod clearance;
mod elements;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use dynid_files::SourceFile;
use dynid_model::closed::ClosedMechanism;
use dynid_model::element::ElementRegistry;
use dynid_model::{Description, EffortModel, JointKind, Mechanism, MechanismWarning, RobotModel, Ties};
use dynid_robots::{ElementSpec, RobotFile};

use crate::Error;
use crate::caution::{self, Caution};
use crate::elements::{ElementPlan, REACTION_FRICTION};
use crate::error::ElasticFault;
use crate::input_record::{InputKind, InputRecord};
use crate::log_axis::{self, LogAxis};
use crate::prior::Prior;
pub use clearance::refuse_clearance;

/// How a robot file is to be read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RobotOptions {
    /// Gravity in place of the file's, m/s².
    pub gravity: Option<[f64; 3]>,
    /// Couple mimic joints.
    pub couple_mimics: bool,
    /// Put a floating joint under the root link.
    pub floating_base: bool,
    /// Joints held at a position.
    pub locked: Vec<(String, f64)>,
}

/// A robot file that has been read.
#[derive(Debug, Clone)]
pub struct Robot {
    /// Where it came from.
    pub path: PathBuf,
    /// The mechanism; of one with loops its tree.
    pub mechanism: Mechanism,
    /// The mechanism with its loops closed, if it has some.
    pub closed: Option<Arc<ClosedMechanism>>,
    /// What logs have columns for: joints, then motors behind springs.
    pub axes: Vec<LogAxis>,
    /// What the file says about elements.
    pub elements: ElementSpec,
    /// The file itself; its description holds locked joints as fixed ones.
    pub file: RobotFile,
    /// Oddities, in words.
    pub warnings: Vec<String>,
}

impl Robot {
    /// Reads a robot and compiles its mechanism.
    ///
    /// # Errors
    /// [`Error::RobotFile`], [`Error::Mechanism`], [`Error::UnknownJoint`], [`Error::Elastic`], [`Error::Loops`].
    pub fn load(path: &Path, options: &RobotOptions) -> Result<Robot, Error> {
        Self::of_file(path, dynid_robots::robot::read(path)?, options)
    }

    /// Reads a robot from the text of a URDF, MJCF, SDF, xacro or TOML file; `path` says which by its ending, and stands in messages and provenance.
    ///
    /// # Errors
    /// Fails as [`Robot::load`] does.
    pub fn parse(text: &str, path: &Path, options: &RobotOptions) -> Result<Robot, Error> {
        Self::of_file(path, dynid_robots::robot::parse(text, path)?, options)
    }

    fn of_file(path: &Path, mut file: RobotFile, options: &RobotOptions) -> Result<Robot, Error> {
        let d = &mut file.description;
        if let Some(g) = options.gravity {
            d.gravity = g;
        }
        d.couple_mimics |= options.couple_mimics;
        d.floating_base |= options.floating_base;
        if let Some(e) = file.elements.elastic.iter().find(|e| is_fixed(d, &e.joint)) {
            return Err(Error::Elastic { joint: e.joint.clone(), fault: ElasticFault::Fixed });
        }
        Self::compile(path, file, &options.locked)
    }

    /// A robot that a program has put together; `path` stands in messages and provenance.
    ///
    /// # Errors
    /// [`Error::Mechanism`], [`Error::Elastic`], [`Error::Loops`].
    pub fn of_parts(path: &Path, file: RobotFile) -> Result<Robot, Error> {
        Self::compile(path, file, &[])
    }

    fn compile(path: &Path, mut file: RobotFile, locked: &[(String, f64)]) -> Result<Robot, Error> {
        let named = |source| Error::Mechanism { file: path.display().to_string(), source };
        file.description.lock(locked).map_err(|e| match e {
            dynid_model::MechanismError::UnknownJoint { name, known } => Error::UnknownJoint { name, known },
            other => named(other),
        })?;
        let mechanism = file.description.build().map_err(named)?;
        // Where sensors measure the load, bodies are no matter.
        let measured = file.elements.elastic.iter().any(|e| e.sensor);
        let bodies = mechanism.warnings().iter().filter(|_| !measured);
        let mut warnings: Vec<String> = bodies.map(ToString::to_string).collect();
        warnings.extend(file.warnings.iter().cloned());
        warnings.extend(held(locked));
        let closed = closed(path, &mut file, &mechanism)?;
        warnings.extend(closed.iter().flat_map(|c| c.warnings().iter().map(ToString::to_string)));
        let mut elements = file.elements.clone();
        elements.elastic.retain(|e| !is_fixed(&file.description, &e.joint));
        elements.clearance.retain(|c| !is_fixed(&file.description, &c.joint));
        let bare = ElementPlan::bare(&mechanism, &elements)?.with_loops(closed.clone());
        let axes = log_axis::axes(&bare.model(&mechanism)?);
        let inside = mechanism.rate_names();
        let is_joint = |joint: &String| axes.iter().any(|a| a.name == *joint) || inside.contains(joint);
        elements.per_joint.retain(|(joint, _)| is_joint(joint));
        warnings.extend(unlisted(&elements));
        Ok(Robot { path: path.to_owned(), mechanism, closed, axes, elements, file, warnings })
    }

    /// The robot file that was read, the URDF that it refers to, and what they include.
    pub fn inputs(&self) -> Vec<InputRecord> {
        let kind = |(k, source): (usize, &SourceFile)| {
            let ends = |end: &str| source.path.to_lowercase().ends_with(end);
            let kind = match () {
                () if k == 0 => InputKind::Robot,
                () if self.file.urdf.as_ref() == Some(&source.path) => InputKind::Urdf,
                () if [".stl", ".obj", ".msh"].into_iter().any(ends) => InputKind::Mesh,
                () => InputKind::Included,
            };
            InputRecord::of(kind, source)
        };
        self.file.sources.iter().enumerate().map(kind).collect()
    }

    /// Oddities of the file, each with what mends it; without those of bodies of which the prior tells, or which follow from others.
    pub fn cautions(&self, prior: &Prior, ties: Option<&Ties>) -> Vec<Caution> {
        let told = |name: &String| {
            let own = prior.bodies.iter().position(|body| body.links.contains(name));
            own.is_some_and(|b| {
                prior.bodies[b].warning().is_some() || ties.is_some_and(|ties| ties.body_follows(b))
            })
        };
        let of =
            |message: &String| {
                let known = self.mechanism.warnings().iter().find(|w| w.to_string() == *message);
                match known {
                    Some(
                        MechanismWarning::NotPhysical { body, .. } | MechanismWarning::NotStated { body },
                    ) if told(body) => None,
                    _ => Some(Caution::warn(caution::ROBOT_FILE, message, remedy(known))),
                }
            };
        self.warnings.iter().filter_map(of).collect()
    }

    /// Returns the robot with more joints held still; a motor stands still with its joint.
    ///
    /// # Errors
    /// Fails as [`Robot::load`] does.
    pub fn locked(&self, joints: &[(String, f64)]) -> Result<Robot, Error> {
        let is_motor = |name: &String| self.axes.iter().any(|a| a.motor && a.name == *name);
        let (motors, joints): (Vec<_>, Vec<_>) = joints.iter().cloned().partition(|(name, _)| is_motor(name));
        let joints = joints.as_slice();
        let driven = |motor: &str| self.elements.elastic.iter().find(|e| e.motor == motor);
        for (motor, _) in &motors {
            let Some(spec) = driven(motor) else { continue };
            if !joints.iter().any(|(joint, _)| *joint == spec.joint) {
                let fault = ElasticFault::MotorNotLogged(motor.clone());
                return Err(Error::Elastic { joint: spec.joint.clone(), fault });
            }
        }
        let mut robot = Self::compile(&self.path, self.file.clone(), joints)?;
        let mut warnings = self.warnings.clone();
        warnings.extend(robot.warnings.iter().filter(|w| !self.warnings.contains(w)).cloned());
        robot.warnings = warnings;
        Ok(robot)
    }

    /// Returns the robot with kinds of elements of a program's own among those that its joints may have.
    #[must_use]
    pub fn with_registry(mut self, registry: ElementRegistry) -> Self {
        self.file.elements.registry = registry.clone();
        self.elements.registry = registry;
        self
    }

    /// Returns the robot with another file.
    ///
    /// # Errors
    /// Fails as [`Robot::load`] does.
    pub fn changed(&self, change: impl FnOnce(&mut RobotFile)) -> Result<Robot, Error> {
        let mut file = self.file.clone();
        change(&mut file);
        Self::compile(&self.path, file, &[])
    }

    /// The robot with its springs and without any other element; no bodies act where sensors measure the load.
    ///
    /// # Errors
    /// [`Error::Elastic`].
    pub fn skeleton(&self) -> Result<RobotModel, Error> {
        ElementPlan::bare(&self.mechanism, &self.elements)?
            .with_loops(self.closed.clone())
            .model(&self.mechanism)
    }

    /// Values of the robot file for the parameters of [`Robot::skeleton`], 0 where it states none.
    pub fn skeleton_values(&self, skeleton: &RobotModel) -> Vec<f64> {
        let table = skeleton.parameters();
        let mut values = table.prior();
        for (name, value) in crate::elements::stated_springs(&self.elements.elastic) {
            if let Some(column) = table.column(&name) {
                values[column] = value;
            }
        }
        values
    }

    /// Names of the rates that elements act at: what logs have columns for, but all joints of a mechanism with loops.
    pub fn rate_names(&self) -> Vec<String> {
        match self.closed {
            Some(_) => self.mechanism.rate_names(),
            None => crate::log_axis::names(&self.axes),
        }
    }

    /// Whether a drive can be expected at a rate: not at passive joints of a mechanism with loops.
    pub fn is_driven(&self, rate: usize) -> bool {
        self.closed.as_ref().is_none_or(|closed| closed.driven().contains(&rate))
    }

    /// Coordinates as a states table names them.
    pub fn state_joints(&self) -> Vec<dynid_logs::StateJoint> {
        state_joints(&self.mechanism, self.closed.as_deref(), &self.axes)
    }
}

/// Closes the loops of a file. Joints that are held are no longer driven and have no home position.
fn closed(
    path: &Path,
    file: &mut RobotFile,
    mechanism: &Mechanism,
) -> Result<Option<Arc<ClosedMechanism>>, Error> {
    if file.closures.is_empty() {
        return Ok(None);
    }
    if let Some(e) = file.elements.elastic.first() {
        return Err(Error::Unsupported(format!(
            "joint `{}` is elastic, and mechanisms with loops have stiff joints here: leave out `elastic`",
            e.joint
        )));
    }
    if mechanism.bodies().iter().any(|b| b.joint.name == dynid_model::mechanism::ROOT_JOINT) {
        return Err(Error::Unsupported(
            "a mechanism with loops stands on the ground: no floating base".to_owned(),
        ));
    }
    let moves = |name: &String| mechanism.bodies().iter().any(|b| b.joint.name == *name);
    file.home.retain(|(name, _)| moves(name));
    if let Some(driven) = &mut file.actuated {
        driven.retain(moves);
    }
    ClosedMechanism::new(mechanism.clone(), file.closures.clone(), file.actuated.as_deref(), &file.home)
        .map(|closed| Some(Arc::new(closed)))
        .map_err(|source| Error::Loops { file: path.display().to_string(), source: Box::new(source) })
}

fn is_fixed(description: &Description, joint: &str) -> bool {
    description.joints.iter().any(|j| j.name == joint && j.kind == JointKind::Fixed)
}

/// Locked joints in words, those at one position together: a mobile robot may have dozens.
/// What mends an oddity; `None`: joints that are held, or how loops share their forces.
fn remedy(warning: Option<&MechanismWarning>) -> &'static str {
    match warning {
        Some(MechanismWarning::NotPhysical { .. } | MechanismWarning::NotStated { .. }) => {
            "state mass, centre of mass and inertia of the body: `<inertial>` in a URDF, `mass`, `com` and \
             `inertia_com = [xx, xy, xz, yy, yz, zz]` in TOML"
        }
        Some(MechanismWarning::MimicIndependent { .. }) => {
            "`couple_mimics = true` in the configuration couples it"
        }
        _ => {
            "nothing, if the robot was recorded like this; else log the joint and take it out of `[locked]`, or state what is driven by \
             `actuated = [..]` in the robot file"
        }
    }
}

fn held(locked: &[(String, f64)]) -> Vec<String> {
    let mut at: Vec<(f64, Vec<&str>)> = Vec::new();
    for (joint, position) in locked {
        match at.iter_mut().find(|(p, _)| p == position) {
            Some((_, joints)) => joints.push(joint),
            None => at.push((*position, vec![joint])),
        }
    }
    at.into_iter()
        .map(|(position, joints)| match joints[..] {
            [joint] => MechanismWarning::Locked { joint: joint.to_owned(), position }.to_string(),
            _ => format!(
                "joints {} are held at {position}",
                joints.iter().map(|j| format!("`{j}`")).collect::<Vec<_>>().join(", ")
            ),
        })
        .collect()
}

/// Coordinates of a model as a states table names them.
pub fn model_state_joints(model: &RobotModel) -> Vec<dynid_logs::StateJoint> {
    let closed = model.closed().map(|closed| closed.machine().as_ref());
    state_joints(model.mechanism(), closed, &crate::log_axis::axes(model))
}

/// Joints of a mechanism, then the axes behind them; of one with loops the independent joints alone.
fn state_joints(
    mechanism: &Mechanism,
    closed: Option<&ClosedMechanism>,
    axes: &[LogAxis],
) -> Vec<dynid_logs::StateJoint> {
    if let Some(closed) = closed {
        let names = mechanism.rate_names();
        let scalar = |rate: &usize| dynid_logs::StateJoint::Scalar(names[*rate].clone());
        return closed.independent().iter().map(scalar).collect();
    }
    let others = axes.iter().skip(mechanism.rates()).map(|a| dynid_logs::StateJoint::Scalar(a.name.clone()));
    mechanism
        .bodies()
        .iter()
        .filter(|b| mechanism.follows().is_none() || b.joint.mimic.is_none())
        .map(|b| {
            let name = b.joint.name.clone();
            if b.joint.rates() == 6 {
                dynid_logs::StateJoint::Floating(name)
            } else {
                dynid_logs::StateJoint::Scalar(name)
            }
        })
        .chain(others)
        .collect()
}

/// Friction that follows loads where the file states it, but not among the elements of its joint.
fn unlisted(elements: &ElementSpec) -> Vec<String> {
    let lists = |joint: &str| {
        let own = elements.per_joint.iter().find(|(j, _)| j == joint).map(|(_, list)| list);
        own.unwrap_or(&elements.defaults).iter().any(|name| name == REACTION_FRICTION)
    };
    let idle = elements.reactions.iter().filter(|r| !lists(&r.joint));
    idle.map(|r| {
        format!(
            "joint `{0}`: `{REACTION_FRICTION}` is stated and does nothing, since it is not among the joint's elements: \
             `elements = [\"{REACTION_FRICTION}\"]` under `[element.{0}]`",
            r.joint
        )
    })
    .collect()
}

/// Refuses mechanisms with loops, for work that knows trees alone. `what`: what they are not.
pub fn refuse_loops(robot: &Robot, what: &str) -> Result<(), Error> {
    match robot.file.closures.first() {
        None => Ok(()),
        Some(closure) => {
            Err(Error::Unsupported(format!("mechanisms with loops (`{}`) are not {what}", closure.name)))
        }
    }
}

/// Refuses mechanisms with more drives than free motions: what drives do against each other shows in no motion, so a model
/// says nothing about the effort of a single one.
pub fn refuse_internal_load(robot: &Robot, what: &str) -> Result<(), Error> {
    let Some(closed) = robot.closed.as_ref().filter(|c| c.driven().len() > c.mobility()) else {
        return Ok(());
    };
    Err(Error::Unsupported(format!(
        "{} drives ({}) for {} free motions: their efforts hold an internal load that no model of motion knows, so they are not {what}; name in `actuated` only as many as there are free motions if the others are idle",
        closed.driven().len(),
        closed.driven_names().join(", "),
        closed.mobility()
    )))
}

/// Refuses robots with motors behind springs, for work that knows stiff joints alone. `what`: what they are not.
pub fn refuse_elastic(robot: &Robot, what: &str) -> Result<(), Error> {
    match robot.elements.elastic.first() {
        None => Ok(()),
        Some(e) => Err(Error::Unsupported(format!(
            "joint `{}` is elastic, and elastic joints are not {what}: use the robot file without `elastic`",
            e.joint
        ))),
    }
}
