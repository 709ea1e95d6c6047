//! What is exported, and the robot file that it goes into.

use std::path::{Component, Path, PathBuf};

use dynid_files::FileMember;
use dynid_identify::Error;
use dynid_identify::estimate::{Estimate, Split};
use dynid_identify::known_friction::KnownFriction;
use dynid_identify::pipeline::Identification;
use dynid_model::{Description, Inertia, RobotModel};
use dynid_robots::RobotFile;

/// A robot with identified parameters, whatever they come from.
#[derive(Debug, Clone, Copy)]
pub struct Identified<'a> {
    /// The robot as it was identified; joints that were held are fixed.
    pub description: &'a Description,
    /// Effort model of the robot.
    pub model: &'a RobotModel,
    /// Linear parameters of the model.
    pub values: &'a [f64],
    /// Ten standard parameters per body whose rigid effort loads the gears of `load` elements; `None`: those of the model's
    /// mechanism.
    pub load_reference: Option<&'a [f64]>,
    /// Friction that the model knows beside its parameters, which are errors of it.
    pub known_friction: &'a [KnownFriction],
}

/// An identified robot as an estimate file holds it.
#[derive(Debug)]
pub struct IdentifiedRobot {
    description: Description,
    model: RobotModel,
    values: Vec<f64>,
    load_reference: Option<Vec<f64>>,
    known_friction: Vec<KnownFriction>,
}

impl IdentifiedRobot {
    /// What the functions of this module take.
    pub fn identified(&self) -> Identified<'_> {
        Identified {
            description: &self.description,
            model: &self.model,
            values: &self.values,
            load_reference: self.load_reference.as_deref(),
            known_friction: &self.known_friction,
        }
    }
}

impl IdentifiedRobot {
    /// The robot of an estimate; `file` stands in messages.
    ///
    /// # Errors
    /// [`Error::EstimateFile`] if the record contradicts itself.
    pub fn of(estimate: &Estimate, file: &Path) -> Result<IdentifiedRobot, Error> {
        let model = estimate.effort_model(file, Split::Consistent)?;
        let description = estimate
            .model
            .description(&estimate.robot)
            .map_err(|message| Error::EstimateFile { file: file.display().to_string(), message })?;
        Ok(IdentifiedRobot {
            description,
            model,
            values: estimate.values(Split::Consistent),
            load_reference: estimate.model.load_reference.clone(),
            known_friction: estimate.model.known_friction.clone(),
        })
    }
}

/// A robot file that identified parameters go into.
#[derive(Debug, Clone)]
pub struct Source {
    pub(crate) path: PathBuf,
    pub(crate) file: RobotFile,
}

impl Source {
    /// Reads a robot file (URDF, MJCF, SDF or TOML) and the URDF that it may refer to.
    ///
    /// # Errors
    /// [`Error::RobotFile`], [`Error::Read`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        Ok(Self::of(dynid_robots::robot::read(path)?, path))
    }

    /// A robot file from its text; `path` stands in messages, and places files that the text refers to.
    ///
    /// # Errors
    /// As [`Source::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        Ok(Self::of(dynid_robots::robot::parse(text, path)?, path))
    }

    fn of(file: RobotFile, path: &Path) -> Self {
        Source { path: FileMember::of(path).path, file }
    }

    /// Text of the MJCF, if the robot is one.
    pub fn mjcf_text(&self) -> Option<&str> {
        self.file.xml.as_deref().filter(|_| self.is_mjcf())
    }

    /// Text of the URDF that holds the tree, if one does.
    pub fn urdf_text(&self) -> Option<&str> {
        self.file.xml.as_deref().filter(|_| self.file.urdf.is_some())
    }

    /// SHA-256 of the file, hexadecimal; `None` of a text.
    pub fn sha256(&self) -> Option<&str> {
        self.file.sources.first().map(|file| file.sha256.as_str())
    }

    /// The robot as the file has it.
    pub fn description(&self) -> &Description {
        &self.file.description
    }

    /// Whether the robot is an MJCF, into which identified parameters are put in place.
    pub fn is_mjcf(&self) -> bool {
        self.file.mjcf.is_some()
    }

    /// Files of its folder that an MJCF includes, by their paths from there: they may change with it.
    pub fn included(&self) -> Vec<&str> {
        let below = |name: &&str| {
            let mut parts = Path::new(name).components();
            !name.is_empty() && parts.all(|part| matches!(part, Component::Normal(_)))
        };
        self.file.mjcf.iter().flatten().map(String::as_str).filter(below).collect()
    }

    /// Whether a link stands for nothing but the place between two joints of one body of an MJCF.
    pub(crate) fn is_between(&self, link: &str) -> bool {
        let mut massless = self.file.elements.ties.iter().flat_map(|tie| &tie.massless);
        self.is_mjcf() && massless.any(|name| name == link)
    }
}

impl<'a> Identified<'a> {
    /// The robot of an identification without what belongs to single logs.
    pub fn of(id: &'a Identification) -> Self {
        let (model, values) = id.robot_alone();
        Identified {
            description: &id.robot.file.description,
            model,
            values,
            load_reference: id.plan.load_reference.as_deref(),
            known_friction: &id.plan.known,
        }
    }
}

/// Inertias of the bodies at the head of a parameter vector.
pub(crate) fn inertias(values: &[f64]) -> impl Iterator<Item = Inertia> {
    values.chunks_exact(10).map(|ten| Inertia(std::array::from_fn(|k| ten[k])))
}
