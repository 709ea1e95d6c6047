//! What a robot file states of the parameters of an identified model.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use dynid_model::EffortModel;
use dynid_robots::RobotFile;
use dynid_robots::urdf;

use super::structure;
use crate::Error;
use crate::elements::ElementPlan;
use crate::estimate::{Estimate, ModelRecord};
use crate::export::held_joints;
use crate::robot::{Robot, RobotOptions};

/// A robot file that has been read.
#[derive(Debug)]
pub struct StatedRobot {
    path: PathBuf,
    file: RobotFile,
}

impl StatedRobot {
    pub(super) fn read(path: &Path) -> Result<Self, Error> {
        Ok(StatedRobot { path: path.to_owned(), file: dynid_robots::robot::read(path)? })
    }

    /// Values by the names of parameters, the robot read as it was for an estimate; the inner `Err` says why it is another robot.
    pub(super) fn values(
        &self,
        like: &Estimate,
        estimate: &Path,
    ) -> Result<Result<BTreeMap<String, f64>, String>, Error> {
        let recorded = like
            .model
            .description(&like.robot)
            .map_err(|message| Error::EstimateFile { file: estimate.display().to_string(), message })?;
        let locked = match held_joints(&self.file.description, &recorded) {
            Ok(locked) => locked,
            Err(fault) => return Ok(Err(fault)),
        };
        let options = RobotOptions {
            gravity: Some(like.model.gravity),
            couple_mimics: like.model.couple_mimics,
            floating_base: like.model.floating_base,
            locked,
        };
        let robot = Robot::load(&self.path, &options)?;
        let plan = ElementPlan::bare(&robot.mechanism, &robot.elements)?.with_loops(robot.closed.clone());
        let stated = ModelRecord::new(&robot.file.description, &robot.mechanism, &plan);
        if let Err(fault) = structure::same_robot(&like.model, &stated) {
            return Ok(Err(fault));
        }
        let skeleton = robot.skeleton()?;
        let names = skeleton.parameters().linear.iter().map(|p| p.name.clone());
        let links = names.zip(robot.skeleton_values(&skeleton)).collect();
        let plan = ElementPlan::new(&robot.mechanism, &robot.elements, None, |_| false)?;
        let mut values: BTreeMap<String, f64> = links;
        values.extend(self.dynamics()?);
        values.extend(plan.stated_values());
        Ok(Ok(values))
    }

    /// Viscous and Coulomb friction that a URDF states.
    fn dynamics(&self) -> Result<Vec<(String, f64)>, Error> {
        let (Some(path), Some(text)) = (&self.file.urdf, &self.file.xml) else { return Ok(Vec::new()) };
        let joints = urdf::dynamics(text, path)?;
        let values = |j: &urdf::JointDynamics| {
            [(format!("{}.fv", j.joint), j.damping), (format!("{}.fc", j.joint), j.friction)]
        };
        Ok(joints.iter().flat_map(values).collect())
    }
}
