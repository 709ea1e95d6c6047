//! Joints with clearance: bodies whose journals move in their bearings.

use std::sync::Arc;

use dynid_model::element::JointElement;
use dynid_model::{Mechanism, RobotModel};

use super::Robot;
use crate::Error;
use crate::elements::contacts;

impl Robot {
    /// The robot's bodies with journals that move in their bearings, and the contacts of these as its only elements.
    ///
    /// Rates are those of the robot's mechanism, then two translations per joint with clearance. `None` if no joint has any.
    ///
    /// # Errors
    /// [`Error::Mechanism`], [`Error::UnknownJoint`]; [`Error::Unsupported`] for mechanisms with loops.
    pub fn with_clearance(&self) -> Result<Option<RobotModel>, Error> {
        let Some(mechanism) = self.moving()? else { return Ok(None) };
        crate::robot::refuse_loops(self, "simulated with clearance")?;
        let contacts = contacts(&self.elements.clearance, &mechanism.rate_names())?.into_iter();
        let contacts = contacts.map(|contact| Box::new(contact) as Box<dyn JointElement>);
        Ok(Some(RobotModel::new(mechanism, contacts.collect())))
    }

    /// The mechanism with translations of the journals of joints with clearance, the last of its rates; `None` if no joint has any.
    ///
    /// # Errors
    /// [`Error::Mechanism`].
    fn moving(&self) -> Result<Option<Mechanism>, Error> {
        if self.elements.clearance.is_empty() {
            return Ok(None);
        }
        let named = |source| Error::Mechanism { file: self.path.display().to_string(), source };
        let joints: Vec<&str> = self.elements.clearance.iter().map(|c| c.joint.as_str()).collect();
        let description = self.file.description.with_clearance(&joints).map_err(named)?;
        Ok(Some(description.build().map_err(named)?))
    }

    /// [`Robot::moving`] for a plan of elements.
    pub(super) fn journals(&self) -> Result<Option<Arc<Mechanism>>, Error> {
        Ok(self.moving()?.map(Arc::new))
    }

    /// What a fit leaves out because joints have clearance, in words.
    pub fn clearance_warnings(&self) -> impl Iterator<Item = String> + '_ {
        self.elements.clearance.iter().map(|c| {
            format!(
                "joint `{}` has clearance (gap {} µm), which is not part of the fit: geometry counts as ideal, and the friction \
                 of its bearing is carried by the friction elements of the joint",
                c.joint,
                (c.gap() * 1e9).round() / 1e3
            )
        })
    }
}

/// Refuses robots with clearance, for work that has no form for it. `what`: what their joints are not.
pub fn refuse_clearance(robot: &Robot, what: &str) -> Result<(), Error> {
    match robot.elements.clearance.first() {
        None => Ok(()),
        Some(c) => Err(Error::Unsupported(format!(
            "joint `{}` has clearance, and joints with clearance are not {what}: use the robot file without `clearance`",
            c.joint
        ))),
    }
}
