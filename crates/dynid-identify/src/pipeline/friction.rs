//! Friction shapes found beside the elements of a plan.

use dynid_estimate::separable::ShapeVerdict;
use dynid_model::EffortModel;
use dynid_rows::conditioning::{
    BasePrior, Conditioning, FrictionChoice, JointFriction, ShapeKind, ShapeTrial, Stage, choose_friction,
};

use crate::Error;
use crate::elements::{ElementPlan, shape_element, shapes_beside};
use crate::problem::Problem;
use crate::shape::ShapeFit;
use crate::structure::Structure;

/// Chooses shapes for all joints and adds them to the plan; shape parameters start at the values found.
///
/// # Errors
/// [`Error::Conditioning`].
pub(super) fn choose(
    problem: &mut Problem,
    choices: &Conditioning,
    progress: &mut dyn FnMut(Stage),
) -> Result<FrictionChoice, Error> {
    let settings = problem.conditioning_settings();
    // Neither searches nor factors of logs have a form for friction that remembers the motion.
    let remembers = problem.settings.estimator.search.is_none() && problem.plan.log_terms.scaled().is_empty();
    let Problem { model, structure, plan, logs, .. } = problem;
    let unloaded = model.mechanism().follows().is_some() || model.closed().is_some();
    let rates = model.mechanism().rates();
    let kinds: Vec<Vec<ShapeKind>> = (model.outputs().iter().enumerate())
        .map(|(rate, output)| match plan.known_friction(&output.name) {
            // Its shape is known already.
            Some(_) => Vec::new(),
            None => {
                let elements = &plan.per_rate[model.tree_rate(rate)];
                let mut kinds = shapes_beside(plan.registry(), elements, unloaded || rate >= rates);
                kinds.retain(|kind| remembers || *kind != ShapeKind::MaxwellSlip);
                kinds
            }
        })
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
        &settings,
        progress,
    )?;
    let mut found = found;
    let joints: Vec<&str> = model.outputs().iter().map(|o| o.name.as_str()).collect();
    share(plan, &joints, &mut found.per_output);
    for (rate, joint) in found.per_output.iter().enumerate() {
        for accepted in &joint.accepted {
            plan.add_shape(model.tree_rate(rate), &model.outputs()[rate].name, &accepted.shape);
        }
    }
    if !found.load.is_empty() {
        plan.load_reference = Some(found.load[..model.mechanism().inertial_parameters()].to_vec());
    }
    Ok(found)
}

/// Gives joints all of whose parameters are equal the shapes of one another.
fn share(plan: &ElementPlan, joints: &[&str], chosen: &mut [JointFriction]) {
    for (rate, joint) in joints.iter().enumerate() {
        for other in plan.equal_joints(joint) {
            let Some(from) = joints.iter().position(|name| name == other) else { continue };
            for trial in chosen[from].accepted.clone() {
                let own = &mut chosen[rate];
                if own.accepted.iter().all(|t| t.shape.kind != trial.shape.kind) {
                    own.rejected.retain(|t| t.shape.kind != trial.shape.kind);
                    own.accepted.push(trial);
                }
            }
        }
    }
    // One order of elements for all: equal joints have equal parameters one by one.
    for (name, joint) in joints.iter().zip(chosen) {
        if plan.equal_joints(name).next().is_none() {
            continue;
        }
        joint.accepted.sort_by_key(|t| ShapeKind::ALL.iter().position(|k| *k == t.shape.kind));
    }
}

/// Drops chosen shapes whose shape parameter the logs do not see after all, falls from rest that came out as rises (`fs` below
/// `fc`) and springs that would drive the joint (`fm` below zero), whose joint has its mask over reversals again. Tells
/// whether there were any.
pub(super) fn drop_refuted(
    problem: &mut Problem,
    found: &ShapeFit,
    chosen: &mut [JointFriction],
    choices: &mut Conditioning,
) -> bool {
    let (model, plan) = (&found.model, &mut problem.plan);
    let table = model.parameters();
    let unseen = |joint: &str, trial: &ShapeTrial| {
        // Held-out blocks saw that friction gives way; over how little a travel may stay unknown.
        if trial.shape.kind == ShapeKind::MaxwellSlip {
            return false;
        }
        let (_, Some(symbol)) = shape_element(trial.shape.kind) else { return false };
        let name = format!("{joint}.{symbol}");
        let place = table.shape.iter().position(|s| s.name == name);
        place.is_some_and(|k| found.finding(k).verdict == ShapeVerdict::NotSeen)
    };
    let rises = |joint: &str, trial: &ShapeTrial| {
        let value = |symbol: &str| table.column(&format!("{joint}.{symbol}")).map(|c| found.linear[c]);
        trial.shape.kind == ShapeKind::Stribeck
            && matches!((value("fs"), value("fc")), (Some(fs), Some(fc)) if fs < fc)
    };
    let drives = |joint: &str, trial: &ShapeTrial| {
        let fm = table.column(&format!("{joint}.fm")).map(|c| found.linear[c]);
        trial.shape.kind == ShapeKind::MaxwellSlip && fm.is_some_and(|fm| fm < 0.0)
    };
    let mut dropped = false;
    for (rate, (output, joint)) in model.outputs().iter().zip(chosen).enumerate() {
        let (gone, kept): (Vec<ShapeTrial>, Vec<ShapeTrial>) = joint.accepted.drain(..).partition(|trial| {
            unseen(&output.name, trial) || rises(&output.name, trial) || drives(&output.name, trial)
        });
        joint.accepted = kept;
        for trial in gone {
            plan.remove_shape(model.tree_rate(rate), &output.name, &trial.shape);
            joint.rejected.push(trial);
            dropped = true;
        }
        if !joint.has_spring()
            && let Some(mask) = joint.mask_without_spring.take()
        {
            choices.set_mask(rate, mask);
        }
    }
    dropped
}

#[cfg(test)]
mod tests {
    use dynid_model::element::ElementRegistry;

    use super::*;

    #[test]
    fn shapes_are_tried_beside_what_they_add_to() {
        let kinds = |list: &[&str]| {
            let list: Vec<String> = list.iter().map(|n| (*n).to_owned()).collect();
            shapes_beside(&ElementRegistry::default(), &list, false)
        };
        assert_eq!(kinds(&["coulomb", "viscous", "offset", "rotor"]), ShapeKind::ALL);
        assert_eq!(
            kinds(&["stribeck", "viscous"]),
            [ShapeKind::ViscousMagnitude, ShapeKind::Load, ShapeKind::MaxwellSlip]
        );
        assert_eq!(kinds(&["asymmetric"]), [ShapeKind::Tanh, ShapeKind::MaxwellSlip]);
        let shaped = ["coulomb", "viscous", "viscous_magnitude", "arctangent"];
        assert_eq!(kinds(&shaped), [ShapeKind::Load, ShapeKind::MaxwellSlip]);
        assert_eq!(kinds(&["rotor"]), []);
    }
}
