//! From a plan to an effort model, known friction included.

use dynid_model::element::JointElement;
use dynid_model::{ClosedModel, Mechanism, RobotModel, TreeModel};

use super::ElementPlan;
use crate::Error;
use crate::known_friction::KnownFriction;
use crate::robot::Robot;
use crate::settings::{FrictionErrors, PerJoint, Settings, serde_name};

impl ElementPlan {
    /// The plan of a run: elements of the robot file, then of the configuration, known friction with them.
    ///
    /// `moves`: whether the joint of a rate moves.
    ///
    /// # Errors
    /// Fails as [`ElementPlan::new`] and [`KnownLaws::of_joints`](crate::known_friction::KnownLaws) do.
    pub fn of_run(
        settings: &Settings,
        robot: &Robot,
        moves: impl Fn(usize) -> bool,
    ) -> Result<ElementPlan, Error> {
        let mut spec = robot.elements.clone();
        for (joint, list) in &settings.elements.joint {
            spec.per_joint.retain(|(j, _)| j != joint);
            spec.per_joint.push((joint.clone(), list.clone()));
        }
        spec.couplings.extend(settings.couplings.iter().cloned());
        let mut plan =
            ElementPlan::new(&robot.mechanism, &spec, settings.elements.default.as_deref(), moves)?
                .with_loops(robot.closed.clone());
        let names = plan.names(&robot.mechanism);
        let law = settings.elements.friction;
        if !law.replaces_any(plan.registry(), &plan.per_rate) {
            let found = format!("`{}` where no joint that moves has any", serde_name(&law));
            return Err(Error::setting(
                "elements.friction",
                "a joint with friction, which the law replaces",
                found,
            ));
        }
        plan.per_rate = plan.per_rate.iter().map(|list| law.of_joint(plan.registry(), list)).collect();
        if let Some(known) = &settings.elements.known {
            plan.known = known.of_joints(&names)?;
            plan.known_source = Some(known.source.clone());
            check_temperature(&known.temperature, &plan.known)?;
            plan.free_errors = known.errors == FrictionErrors::Free;
        }
        Ok(plan)
    }

    /// The effort model of the plan, known friction included. Where sensors measure the load of all joints, the model has no
    /// bodies.
    ///
    /// # Errors
    /// Fails as [`ElementPlan::build`] does.
    pub fn model(&self, mechanism: &Mechanism) -> Result<RobotModel, Error> {
        let bodies = self.bodies(mechanism);
        self.complete(&bodies, self.build(&bodies)?)
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
        Ok(match &self.closed {
            None => tree.into(),
            Some(closed) => ClosedModel::new(tree, closed.clone()).into(),
        })
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

/// Refuses a temperature that no law reads: of a joint whose known friction does not change with it, or of all joints where
/// none's does.
fn check_temperature(stated: &PerJoint, known: &[KnownFriction]) -> Result<(), Error> {
    let reads = |joint: &str| known.iter().any(|law| law.joint == joint && law.is_thermal());
    let unread = match stated {
        PerJoint::All(t) => (!known.iter().any(KnownFriction::is_thermal)).then(|| t.to_string()),
        PerJoint::Each(map) => {
            map.iter().find(|(joint, _)| !reads(joint)).map(|(joint, t)| format!("{joint} = {t}"))
        }
    };
    let expected = "temperatures of joints whose known friction changes with them";
    unread.map_or(Ok(()), |found| Err(Error::setting("elements.temperature", expected, found)))
}
