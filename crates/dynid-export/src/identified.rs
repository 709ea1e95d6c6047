//! What is exported, and the robot file that it goes into.

use std::path::{Path, PathBuf};

use dynid_io::RobotFile;
use dynid_model::{Description, Inertia, RobotModel};

use dynid_identify::Error;
use dynid_identify::estimate::{Estimate, Split};
use dynid_identify::known_friction::KnownFriction;
use dynid_identify::pipeline::Identification;

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
    /// Text of the URDF that holds the tree, if one does.
    pub(crate) urdf: Option<String>,
}

impl Source {
    /// Reads a robot file (URDF or TOML) and the URDF that it may refer to.
    ///
    /// # Errors
    /// [`Error::RobotFile`], [`Error::Read`].
    pub fn read(path: &Path) -> Result<Self, Error> {
        let file = dynid_io::robot::read(path)?;
        let text = |path: &String| {
            dynid_io::input::read_text(path.as_ref())
                .map_err(|source| Error::Read { file: path.into(), source })
        };
        let urdf = file.urdf.as_ref().map(text).transpose()?;
        Ok(Source { path: path.to_owned(), file, urdf })
    }

    /// A robot file from its text; `path` stands in messages, and places a URDF that the text refers to.
    ///
    /// # Errors
    /// As [`Source::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, Error> {
        let file = dynid_io::robot::parse(text, path)?;
        let own = path.display().to_string();
        let of = |name: &String| match *name == own {
            true => Ok(text.to_owned()),
            false => dynid_io::input::read_text(name.as_ref())
                .map_err(|source| Error::Read { file: name.into(), source }),
        };
        let urdf = file.urdf.as_ref().map(of).transpose()?;
        Ok(Source { path: path.to_owned(), file, urdf })
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
