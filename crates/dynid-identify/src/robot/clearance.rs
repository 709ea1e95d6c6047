//! Joints with clearance: bodies whose journals move in their bearings.
//!
//! Only simulation and inspection know them; all else takes joints as ideal.

use dynid_model::element::{ClearanceContact, JointElement};
use dynid_model::mechanism::translation_names;
use dynid_model::{Mechanism, RobotModel};

use super::Robot;
use crate::Error;

impl Robot {
    /// The robot's bodies with journals that move in their bearings, and the contacts of these as its only elements.
    ///
    /// Rates are those of the robot's mechanism, then two translations per joint with clearance. `None` if no joint has any.
    ///
    /// # Errors
    /// [`Error::Mechanism`], [`Error::UnknownJoint`].
    pub fn with_clearance(&self) -> Result<Option<RobotModel>, Error> {
        if !self.elements.clearance.is_empty() {
            crate::robot::refuse_loops(self, "simulated with clearance")?;
        }
        if self.elements.clearance.is_empty() {
            return Ok(None);
        }
        let named = |source| Error::Mechanism { file: self.path.display().to_string(), source };
        let joints: Vec<&str> = self.elements.clearance.iter().map(|c| c.joint.as_str()).collect();
        let description = self.file.description.with_clearance(&joints).map_err(named)?;
        let mechanism = description.build().map_err(named)?;
        let contacts = self.contacts(&mechanism)?;
        Ok(Some(RobotModel::new(mechanism, contacts)))
    }

    fn contacts(&self, mechanism: &Mechanism) -> Result<Vec<Box<dyn JointElement>>, Error> {
        let names = mechanism.rate_names();
        let rate = |name: &str| {
            let unknown = || Error::UnknownJoint { name: name.to_owned(), known: names.clone() };
            names.iter().position(|n| n == name).ok_or_else(unknown)
        };
        let contact = |spec: &dynid_io::ClearanceSpec| {
            let [x, y] = translation_names(&spec.joint);
            Ok(Box::new(ClearanceContact {
                rotation: rate(&spec.joint)?,
                translations: [rate(&x)?, rate(&y)?],
                law: spec.law.clone(),
                friction: spec.friction,
                journal_radius: spec.journal_radius,
            }) as Box<dyn JointElement>)
        };
        self.elements.clearance.iter().map(contact).collect()
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
