//! Friction shapes in words and records.

use dynid_model::EffortModel;
use dynid_model::element::ElementRegistry;
use dynid_rows::conditioning::{JointFriction, ShapeTrial};

use crate::elements::shape_element;
use crate::estimate::FrictionTrial;
use crate::identification::Identification;
use crate::known_friction::KnownFriction;

/// All shapes tried, joint after joint, accepted ones first.
pub(super) fn trials(id: &Identification) -> Vec<FrictionTrial> {
    let registry = ElementRegistry::default();
    let joints = id.model.joints();
    let record = |joint: &str, trial: &ShapeTrial, accepted: bool| {
        let (element, symbol) = shape_element(trial.shape.kind);
        let terms = registry.kind(element).map_or(&[][..], |kind| &kind.shape);
        let term = terms.iter().find(|term| Some(term.symbol) == symbol);
        let slides = joints.iter().any(|j| j.name == joint && j.slides);
        FrictionTrial {
            joint: joint.to_owned(),
            element: element.to_owned(),
            value: term.map(|_| trial.shape.value),
            unit: term.map_or("", |term| term.units[usize::from(slides)]).to_owned(),
            gain: trial.gain,
            standard_error: trial.standard_error,
            accepted,
        }
    };
    id.model
        .outputs()
        .iter()
        .zip(&id.friction)
        .flat_map(|(output, joint)| {
            let accepted = joint.accepted.iter().map(|t| record(&output.name, t, true));
            let others = joint.rejected.iter().map(|t| record(&output.name, t, false));
            accepted.chain(others).collect::<Vec<_>>()
        })
        .collect()
}

/// With three decimals, of less than 0.01 with three significant digits.
fn significant(value: f64) -> String {
    let digits = if value < 0.01 { (2.0 - value.log10().floor()).clamp(3.0, 9.0) } else { 3.0 };
    format!("{value:.*}", digits as usize)
}

/// Shapes of a joint, and why these.
pub(super) fn in_words(joint: &JointFriction) -> (Vec<String>, String) {
    let name = |t: &ShapeTrial| match shape_element(t.shape.kind) {
        (element, Some(key)) => format!("{element} ({key} {})", significant(t.shape.value)),
        (element, None) => element.to_owned(),
    };
    let gain =
        |t: &ShapeTrial| format!("{} {:.1} ± {:.1} %", name(t), 100.0 * t.gain, 100.0 * t.standard_error);
    let list = |trials: &[ShapeTrial]| trials.iter().map(gain).collect::<Vec<_>>().join(", ");
    let reason = match (joint.accepted.is_empty(), joint.rejected.is_empty()) {
        (true, true) => format!(
            "none tried: {} time blocks with rows, or a joint that moves one way or has no friction to refine",
            joint.blocks
        ),
        (true, false) => format!("held-out error does not fall enough: {}", list(&joint.rejected)),
        (false, true) => format!("held-out error falls: {}", list(&joint.accepted)),
        (false, false) => format!(
            "held-out error falls: {}; beside that it would: {}",
            list(&joint.accepted),
            list(&joint.rejected)
        ),
    };
    (joint.accepted.iter().map(name).collect(), reason)
}

/// What known friction does to the parameters of its joint.
pub(super) fn of_known(id: &Identification, law: &KnownFriction) -> String {
    let of_joint = |name: &str| name.rsplit_once('.').is_some_and(|(joint, _)| joint == law.joint);
    let is_error = |name: &str| name.ends_with(".fo") || id.plan.is_friction_error(name);
    let names = id.model.parameters().linear.iter().map(|p| p.name.as_str());
    let errors: Vec<&str> = names.filter(|name| of_joint(name) && is_error(name)).collect();
    match errors[..] {
        [] => "its effort is taken off; the model has no parameters for its errors".to_owned(),
        _ => format!(
            "its effort is taken off; {} {} of it{}",
            errors.join(", "),
            if errors.len() == 1 { "is the error" } else { "are errors" },
            if id.plan.free_errors { ", of any sign" } else { "" }
        ),
    }
}
