//! What an inspection tells of closed loops.

use dynid_model::{BaseParameters, BaseSettings, ClosedModel, EffortModel, Reaction};
use serde::Serialize;

use crate::estimate::ClosureKind;

/// Loops of a mechanism.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct LoopsInspection {
    /// Number of free motions.
    pub mobility: usize,
    /// Driven joints.
    pub driven: Vec<String>,
    /// Cut joints and couplings.
    pub closures: Vec<ClosureRow>,
    /// Smallest over largest singular value of the Jacobian that passive joints follow from, at home: 0 is a singular pose.
    pub singularity_at_home: f64,
    /// Number of base parameters if the forces in the cuts were measured too.
    pub base_parameters_with_multipliers: usize,
}

/// A closure.
#[derive(Debug, Clone, Serialize, schemars::JsonSchema)]
pub struct ClosureRow {
    /// Name.
    pub name: String,
    /// Kind, as in robot files.
    pub kind: ClosureKind,
    /// Links that it joins, or joints that it couples.
    pub between: Vec<String>,
    /// Number of conditions.
    pub conditions: usize,
    /// Whether motion and efforts determine all its forces.
    pub determined: bool,
}

pub(super) fn of(model: &ClosedModel) -> LoopsInspection {
    use dynid_model::closed::Condition;
    let machine = model.machine();
    let (owners, determined) = (machine.condition_closures(), machine.is_determined());
    let closures = machine.closures().iter().enumerate().map(|(k, closure)| {
        let own = || owners.iter().zip(&determined).filter(move |(owner, _)| **owner == k);
        let between = match &closure.condition {
            Condition::Joint { a, b, .. } => vec![a.link.clone(), b.link.clone()],
            Condition::Coordinates { terms, .. } => terms.iter().map(|(joint, _)| joint.clone()).collect(),
        };
        ClosureRow {
            name: closure.name.clone(),
            kind: (&closure.condition).into(),
            between,
            conditions: own().count(),
            determined: own().all(|(_, determined)| *determined),
        }
    });
    let multipliers: Vec<Reaction> =
        (0..machine.conditions()).map(|condition| Reaction::Multiplier { condition }).collect();
    let shape = model.parameters().shape_start();
    let all = BaseParameters::with_reactions(model, &multipliers, &shape, &BaseSettings::default());
    LoopsInspection {
        mobility: machine.mobility(),
        driven: machine.driven_names(),
        closures: closures.collect(),
        singularity_at_home: machine.singularity(&machine.workspace()).measure,
        base_parameters_with_multipliers: all.len(),
    }
}
