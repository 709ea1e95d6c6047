//! Friction that follows reactions: what presses on which joint, and the parameters at which loads are taken.

use std::sync::Arc;

use dynid_model::closed::ClosedMechanism;
use dynid_model::inertia::PARAMETERS_PER_BODY;
use dynid_model::{
    ClosedModel, EffortModel, JointLoad, LoadGroup, LoadReference, Mechanism, ParameterTable, Reaction,
    RobotModel, TreeModel,
};
use dynid_robots::ReactionSpec;

use super::ElementPlan;
use crate::Error;

/// Friction that follows the reaction in a joint.
pub const REACTION_FRICTION: &str = "reaction_friction";

/// Parameters at which the loads of friction and journals are taken.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadValues {
    /// Linear and shape parameters by name; of others the values of the robot file count.
    pub values: Vec<(String, f64)>,
    /// Whether columns tell how friction changes with its loads, as [`LoadReference::linearised`].
    pub linearised: bool,
}

impl LoadValues {
    /// The values of a nonlinear model.
    pub fn of(model: &RobotModel, linear: &[f64], linearised: bool) -> Self {
        let table = model.parameters();
        let linear = table.linear.iter().map(|p| &p.name).zip(linear.iter().copied());
        let shape = table.shape.iter().map(|p| (&p.name, p.start));
        LoadValues { values: linear.chain(shape).map(|(n, x)| (n.clone(), x)).collect(), linearised }
    }
}

impl ElementPlan {
    /// Whether loads that go with the parameters act on efforts: on friction that follows reactions, on journals in their bearings.
    pub fn follows_loads(&self) -> bool {
        self.has_reactions() || self.has_journals()
    }

    /// Whether the friction of some joint follows reactions.
    pub fn has_reactions(&self) -> bool {
        self.per_rate.iter().flatten().any(|name| name == REACTION_FRICTION)
    }

    /// What presses on joints, as the robot file says.
    pub fn reactions(&self) -> &[ReactionSpec] {
        &self.spec.reactions
    }

    /// A model of a tree, with its loops and what presses on its joints and journals.
    pub(super) fn pressed(&self, mechanism: &Mechanism, tree: TreeModel) -> Result<RobotModel, Error> {
        if let Some(moving) = &self.moving {
            return self.journaled(tree, moving);
        }
        let rates: Vec<usize> = (0..self.per_rate.len())
            .filter(|rate| self.per_rate[*rate].iter().any(|name| name == REACTION_FRICTION))
            .collect();
        let names = self.names(mechanism);
        let fault = |rate: usize, fault: String| Error::ElementSetting {
            element: REACTION_FRICTION.to_owned(),
            joint: names[rate].clone(),
            fault,
        };
        let Some(first) = rates.first() else {
            return Ok(match &self.closed {
                None => tree.into(),
                Some(closed) => ClosedModel::new(tree, closed.clone()).into(),
            });
        };
        if !self.coordinates.is_empty() || self.is_measured() {
            let why = "it has no form beside elastic joints: leave out `elastic`";
            return Err(fault(*first, why.to_owned()));
        }
        if !self.log_terms.payloads.is_empty() {
            let why = "payloads of logs are no part of the reactions that it follows: leave out `payload`";
            return Err(fault(*first, why.to_owned()));
        }
        let loads = rates.iter().map(|rate| {
            let of_joint = self.spec.reactions.iter().find(|spec| spec.joint == names[*rate]);
            let spec = of_joint.ok_or_else(|| {
                let why = "nothing says what presses on the joint: \
                           state `reaction_friction = { loads = [{ force = \"radial\", radius = 0.02 }] }` in the robot file";
                fault(*rate, why.to_owned())
            })?;
            joint_load(mechanism, *rate, spec).map_err(|why| fault(*rate, why))
        });
        let loads = loads.collect::<Result<Vec<_>, _>>()?;
        let reference = self.load_reference_of(mechanism, tree.parameters());
        let machine = match &self.closed {
            Some(closed) => closed.clone(),
            None => {
                let open = ClosedMechanism::open(mechanism.clone());
                Arc::new(open.map_err(|e| fault(*first, format!("it has no form here: {e}")))?)
            }
        };
        let model = ClosedModel::new(tree, machine).with_loads(loads, reference);
        Ok(model.map_err(|e| fault(*first, e.to_string()))?.into())
    }

    /// Values of the plan, else those of the robot file.
    pub(super) fn load_reference_of(&self, mechanism: &Mechanism, table: &ParameterTable) -> LoadReference {
        let stated = self.stated_values();
        let found = self.load_values.as_ref();
        let of = |name: &String| {
            let own = found.into_iter().flat_map(|l| &l.values).find(|(n, _)| n == name);
            own.map(|(_, x)| *x)
        };
        let stated = |name: &String| stated.iter().find(|(n, _)| n == name).map(|(_, x)| *x);
        let inertias = mechanism.inertia_vector();
        let linear = table.linear.iter().enumerate().map(|(k, p)| {
            of(&p.name).or_else(|| inertias.get(k).copied()).or_else(|| stated(&p.name)).unwrap_or(0.0)
        });
        LoadReference {
            linear: linear.collect(),
            shape: table
                .shape
                .iter()
                .map(|s| of(&s.name).unwrap_or(s.start).clamp(s.lower, s.upper))
                .collect(),
            linearised: found.is_some_and(|l| l.linearised),
        }
    }
}

/// What presses on a joint, in bodies and columns; `Err` says what does not fit.
fn joint_load(mechanism: &Mechanism, rate: usize, spec: &ReactionSpec) -> Result<JointLoad, String> {
    let body = |joint: &str| mechanism.bodies().iter().position(|b| b.joint.name == joint);
    let group = |load: &dynid_robots::ReactionLoad| {
        let body = body(&load.joint).ok_or_else(|| {
            format!("its load is the reaction in joint `{}`, which does not move here", load.joint)
        })?;
        // Result files may say anything.
        if let Some(component) = load.components.iter().find(|c| **c > 5) {
            return Err(format!("component {component} of a wrench: expected 0 to 5"));
        }
        let components =
            load.components.iter().map(|component| Reaction::Joint { body, component: *component });
        Ok(LoadGroup { components: components.collect(), factor: load.factor })
    };
    let size = mechanism.gravity().0.iter().map(|x| x * x).sum::<f64>().sqrt();
    if size == 0.0 && !spec.weight.is_empty() {
        return Err("the weight of links rests on it, and there is no gravity: state `preload`".to_owned());
    }
    let weight = |(link, share): &(String, f64)| {
        let body = mechanism.bodies().iter().position(|b| b.name == *link).ok_or_else(|| {
            format!("the weight of link `{link}` rests on it, which no moving joint of its own carries here")
        })?;
        Ok((PARAMETERS_PER_BODY * body, size * share))
    };
    Ok(JointLoad {
        rate,
        reactions: spec.loads.iter().map(group).collect::<Result<_, String>>()?,
        weight: spec.weight.iter().map(weight).collect::<Result<_, String>>()?,
        constant: spec.preload,
    })
}
