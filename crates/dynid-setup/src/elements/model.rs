//! From a plan to an effort model, known friction included.

use dynid_model::element::JointElement;
use dynid_model::{Mechanism, RobotModel, TreeModel};

use super::ElementPlan;
use crate::Error;
use crate::known_friction::KnownFriction;

impl ElementPlan {
    /// The effort model of the plan, known friction included. Where sensors measure the load of all joints, the model has no
    /// bodies.
    ///
    /// # Errors
    /// Fails as [`ElementPlan::build`] does.
    pub fn model(&self, mechanism: &Mechanism) -> Result<RobotModel, Error> {
        let bodies = self.bodies(mechanism);
        self.complete(&bodies, self.build(&bodies)?)
    }

    /// The effort model of the plan with its ties: what is fitted. What has been found obeys them already, and goes with [`ElementPlan::model`],
    /// in which every parameter acts where it belongs.
    ///
    /// # Errors
    /// Fails as [`ElementPlan::build`] does; [`Error::Tie`].
    pub fn tied_model(&self, mechanism: &Mechanism) -> Result<RobotModel, Error> {
        self.tied(self.model(mechanism)?)
    }

    /// A model of elements that stand for those of the plan, completed by known friction.
    ///
    /// # Errors
    /// [`Error::ElementSetting`] for bristles beside known bristles, [`Error::UnknownJoint`].
    pub fn complete(
        &self,
        mechanism: &Mechanism,
        elements: Vec<Box<dyn JointElement>>,
    ) -> Result<RobotModel, Error> {
        let names = self.names(mechanism);
        let mut known = Vec::new();
        for law in &self.known {
            let Some(rate) = names.iter().position(|n| *n == law.joint) else {
                return Err(Error::UnknownJoint { name: law.joint.clone(), known: names });
            };
            if law.slipping_bristle().is_some() && self.per_rate[rate].iter().any(|name| name == "lugre") {
                return Err(Error::ElementSetting {
                    element: "lugre".to_owned(),
                    joint: law.joint.clone(),
                    fault: "its known friction has bristles already: take `coulomb` for their error"
                        .to_owned(),
                });
            }
            known.extend(law.elements(rate));
        }
        known.extend(self.log_terms.known(mechanism));
        let coordinates = self.coordinates.clone();
        let tree = TreeModel::with_coordinates(mechanism.clone(), coordinates, elements).with_known(known);
        let tree = match self.free_errors {
            true => tree.with_free_sign(|p| self.is_friction_error(&p.name)),
            false => tree,
        };
        self.pressed(mechanism, tree)
    }

    /// Known friction of a joint.
    pub fn known_friction(&self, joint: &str) -> Option<&KnownFriction> {
        self.known.iter().find(|law| law.joint == joint)
    }

    /// Whether a parameter is the error of a coefficient of known friction.
    pub fn is_friction_error(&self, name: &str) -> bool {
        name.rsplit_once('.').is_some_and(|(joint, symbol)| {
            self.registry().is_coefficient(symbol) && self.known_friction(joint).is_some()
        })
    }
}
