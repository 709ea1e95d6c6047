//! Friction shapes found beside the elements of a plan.

use dynid_estimate::conditioning::{
    BasePrior, Conditioning, ConditioningSettings, FrictionChoice, PreparedLog, ShapeKind, Stage,
    choose_friction,
};
use dynid_model::{EffortModel, RobotModel};

use super::structure::Structure;
use crate::Error;
use crate::elements::ElementPlan;
use crate::elements::friction::is_shaped;

/// Chooses shapes for all joints and adds them to the plan; shape parameters start at the values found.
///
/// # Errors
/// [`Error::Conditioning`].
pub(super) fn choose(
    model: &RobotModel,
    structure: &Structure,
    plan: &mut ElementPlan,
    logs: &[PreparedLog],
    choices: &Conditioning,
    settings: &ConditioningSettings,
    progress: impl FnMut(Stage),
) -> Result<FrictionChoice, Error> {
    let names = model.mechanism().rate_names();
    let follows = model.mechanism().follows().is_some();
    let rates: Vec<Option<usize>> =
        model.outputs().iter().map(|o| names.iter().position(|n| *n == o.name)).collect();
    let kinds: Vec<Vec<ShapeKind>> = rates
        .iter()
        .map(|rate| rate.map_or_else(Vec::new, |r| kinds_beside(&plan.per_rate[r], follows)))
        .collect();
    let Structure { base, prior, regrouping, .. } = structure;
    let prior = BasePrior::new(regrouping, &prior.values, &prior.std);
    let shape = model.parameters().shape_start();
    let found = choose_friction(
        model,
        &shape,
        &base.kept,
        logs,
        &kinds,
        prior.as_ref(),
        choices,
        settings,
        progress,
    )?;
    for (rate, joint) in rates.iter().zip(&found.per_output) {
        for accepted in &joint.accepted {
            if let Some(rate) = rate {
                plan.add_shape(*rate, &names[*rate], &accepted.shape);
            }
        }
    }
    if !found.load.is_empty() {
        plan.load_reference = Some(found.load[..model.mechanism().inertial_parameters()].to_vec());
    }
    Ok(found)
}

/// Kinds of shapes that say something new beside given elements. `follows`: some joints follow others.
fn kinds_beside(elements: &[String], follows: bool) -> Vec<ShapeKind> {
    let has = |name: &str| elements.iter().any(|e| e == name);
    let shaped = elements.iter().any(|name| is_shaped(name));
    let mut out = Vec::new();
    if has("viscous") && !has("viscous_magnitude") {
        out.push(ShapeKind::ViscousMagnitude);
    }
    if has("coulomb") && !shaped {
        out.push(ShapeKind::Stribeck);
    }
    if (has("coulomb") || has("viscous") || has("asymmetric")) && !shaped {
        out.push(ShapeKind::Tanh);
    }
    if (has("coulomb") || has("stribeck")) && !has("load") && !follows {
        out.push(ShapeKind::Load);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shapes_are_tried_beside_what_they_add_to() {
        let kinds =
            |list: &[&str]| kinds_beside(&list.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>(), false);
        let all = [ShapeKind::ViscousMagnitude, ShapeKind::Stribeck, ShapeKind::Tanh, ShapeKind::Load];
        assert_eq!(kinds(&["coulomb", "viscous", "offset", "rotor"]), all);
        assert_eq!(kinds(&["stribeck", "viscous"]), [ShapeKind::ViscousMagnitude, ShapeKind::Load]);
        assert_eq!(kinds(&["asymmetric"]), [ShapeKind::Tanh]);
        assert_eq!(kinds(&["coulomb", "viscous", "viscous_magnitude", "arctangent"]), [ShapeKind::Load]);
        assert_eq!(kinds(&["rotor"]), []);
    }
}
