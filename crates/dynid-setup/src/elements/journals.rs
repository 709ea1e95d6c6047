//! Joints with clearance: journals that move in their bearings.

use std::sync::Arc;

use dynid_model::element::{ClearanceContact, JointElement, JournalFriction};
use dynid_model::mechanism::translation_names;
use dynid_model::{EffortModel, JournalModel, Mechanism, RobotModel, TreeModel};
use dynid_robots::ClearanceSpec;

use super::ElementPlan;
use crate::Error;

/// Element that is left out of the default ones of a joint with clearance.
pub(super) const COULOMB: &str = "coulomb";

impl ElementPlan {
    /// Returns the plan for a robot whose journals move in their bearings. `moving`: the mechanism with translations of the journals of
    /// the joints with clearance; `None`: joints are ideal.
    #[must_use]
    pub fn with_journals(self, moving: Option<Arc<Mechanism>>) -> Self {
        ElementPlan { moving, ..self }
    }

    /// Whether journals move in their bearings.
    pub fn has_journals(&self) -> bool {
        self.moving.is_some()
    }

    /// Joints with clearance whose journals move in their bearings.
    pub fn clearances(&self) -> &[ClearanceSpec] {
        if self.has_journals() { &self.spec.clearance } else { &[] }
    }

    /// Friction of the journals.
    pub(super) fn journal_friction(&self, names: &[String]) -> Result<Vec<Box<dyn JointElement>>, Error> {
        let of = |spec: &ClearanceSpec| {
            let rate = place(&spec.joint, names)?;
            Ok(Box::new(JournalFriction { rate }) as Box<dyn JointElement>)
        };
        self.clearances().iter().map(of).collect()
    }

    /// Friction coefficients of the journals as stated: parameter name, value.
    pub(super) fn stated_journals(&self) -> impl Iterator<Item = (String, f64)> {
        self.clearances().iter().map(|c| (format!("{}.mu", c.joint), c.friction.coefficient))
    }

    /// The model with journals around that of the ideal robot.
    pub(super) fn journaled(&self, ideal: TreeModel, moving: &Mechanism) -> Result<RobotModel, Error> {
        let beside = match () {
            () if self.closed.is_some() => Some("mechanisms with loops"),
            () if !self.elastic.is_empty() => Some("elastic joints"),
            () if self.has_reactions() => Some("`reaction_friction`"),
            () if ideal.mechanism().follows().is_some() => Some("joints that follow others"),
            () if !self.log_terms.payloads.is_empty() => Some("payloads of logs"),
            () => None,
        };
        let joint = self.clearances().first().map_or("", |c| c.joint.as_str());
        if let Some(what) = beside {
            return Err(Error::Unsupported(format!(
                "joint `{joint}` has clearance, and journals that move in their bearings have no form beside {what}: \
                 `clearance = \"ideal\"` under `[elements]` takes joints as ideal"
            )));
        }
        let reference = self.load_reference_of(ideal.mechanism(), ideal.parameters());
        let contacts = contacts(self.clearances(), &moving.rate_names())?;
        let model = JournalModel::new(ideal, moving.clone(), contacts, reference);
        let fault =
            |e: dynid_model::LoadError| Error::Unsupported(format!("joint `{joint}` has clearance: {e}"));
        Ok(model.map_err(fault)?.into())
    }
}

/// Contacts of journals on a mechanism with their translations. `names`: its rates.
///
/// # Errors
/// [`Error::UnknownJoint`].
pub fn contacts(specs: &[ClearanceSpec], names: &[String]) -> Result<Vec<ClearanceContact>, Error> {
    let contact = |spec: &ClearanceSpec| {
        let [x, y] = translation_names(&spec.joint);
        Ok(ClearanceContact {
            rotation: place(&spec.joint, names)?,
            translations: [place(&x, names)?, place(&y, names)?],
            law: spec.law.clone(),
            friction: spec.friction,
            journal_radius: spec.journal_radius,
        })
    };
    specs.iter().map(contact).collect()
}

fn place(name: &str, names: &[String]) -> Result<usize, Error> {
    let unknown = || Error::UnknownJoint { name: name.to_owned(), known: names.to_vec() };
    names.iter().position(|n| n == name).ok_or_else(unknown)
}
