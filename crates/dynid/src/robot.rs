//! From a robot file to a mechanism.

use std::path::{Path, PathBuf};

use dynid_io::{ElementSpec, RobotFile};
use dynid_model::{Mechanism, MechanismWarning};

use crate::Error;

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
    /// The mechanism.
    pub mechanism: Mechanism,
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
    /// [`Error::RobotFile`], [`Error::Mechanism`], [`Error::UnknownJoint`].
    pub fn load(path: &Path, options: &RobotOptions) -> Result<Robot, Error> {
        Self::of_file(path, dynid_io::robot::read(path)?, options)
    }

    /// The same from the text of a TOML robot file; `path` stands in messages and provenance.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn parse(text: &str, path: &Path, options: &RobotOptions) -> Result<Robot, Error> {
        let file = dynid_io::toml_robot::parse(text, &path.display().to_string())?;
        Self::of_file(path, file, options)
    }

    fn of_file(path: &Path, mut file: RobotFile, options: &RobotOptions) -> Result<Robot, Error> {
        let d = &mut file.description;
        if let Some(g) = options.gravity {
            d.gravity = g;
        }
        d.couple_mimics |= options.couple_mimics;
        d.floating_base |= options.floating_base;
        Self::compile(path, file, &options.locked)
    }

    fn compile(path: &Path, mut file: RobotFile, locked: &[(String, f64)]) -> Result<Robot, Error> {
        let named = |source| Error::Mechanism { file: path.display().to_string(), source };
        file.description.lock(locked).map_err(|e| match e {
            dynid_model::MechanismError::UnknownJoint { name, known } => Error::UnknownJoint { name, known },
            other => named(other),
        })?;
        let mechanism = file.description.build().map_err(named)?;
        let mut warnings: Vec<String> = mechanism.warnings().iter().map(ToString::to_string).collect();
        warnings.extend(held(locked));
        let mut elements = file.elements.clone();
        let known = mechanism.rate_names();
        elements.per_joint.retain(|(joint, _)| known.contains(joint));
        Ok(Robot { path: path.to_owned(), mechanism, elements, file, warnings })
    }

    /// The same robot with more joints held still.
    ///
    /// # Errors
    /// As [`Robot::load`].
    pub fn locked(&self, joints: &[(String, f64)]) -> Result<Robot, Error> {
        let mut robot = Self::compile(&self.path, self.file.clone(), joints)?;
        let mut warnings = self.warnings.clone();
        warnings.extend(robot.warnings.iter().filter(|w| !self.warnings.contains(w)).cloned());
        robot.warnings = warnings;
        Ok(robot)
    }

    /// Coordinates as a states table names them.
    pub fn state_joints(&self) -> Vec<dynid_io::StateJoint> {
        state_joints(&self.mechanism)
    }
}

/// Locked joints in words, those at one position together: a mobile robot may have dozens.
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

/// Coordinates of a mechanism as a states table names them.
pub fn state_joints(mechanism: &Mechanism) -> Vec<dynid_io::StateJoint> {
    mechanism
        .bodies()
        .iter()
        .filter(|b| mechanism.follows().is_none() || b.joint.mimic.is_none())
        .map(|b| {
            let name = b.joint.name.clone();
            if b.joint.rates() == 6 {
                dynid_io::StateJoint::Floating(name)
            } else {
                dynid_io::StateJoint::Scalar(name)
            }
        })
        .collect()
}
