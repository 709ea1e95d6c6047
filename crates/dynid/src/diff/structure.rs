//! Whether two models are of one robot.

use super::Side;
use crate::estimate::{Estimate, JointRecord, JointType, ModelRecord};

/// Lengths, m, and cosines that differ by less are the same: files state them with some ten digits.
const SAME: f64 = 1e-6;

/// Compares the structures of two estimates; `Err` says what differs.
pub(super) fn same(a: &Estimate, b: &Estimate) -> Result<(), String> {
    same_robot(&a.model, &b.model)?;
    if a.joints != b.joints {
        return Err(format!("efforts of {} and of {}", a.joints.join(", "), b.joints.join(", ")));
    }
    Ok(())
}

/// Compares the structures of two models; `Err` says what differs.
pub(super) fn same_robot(of_a: &ModelRecord, of_b: &ModelRecord) -> Result<(), String> {
    if of_a.floating_base != of_b.floating_base {
        return Err("one has a floating base, the other stands".to_owned());
    }
    if of_a.couple_mimics != of_b.couple_mimics {
        return Err("mimic joints follow their leaders in one of the two alone".to_owned());
    }
    if of_a.loops != of_b.loops {
        return Err("they close different loops".to_owned());
    }
    for joint in &of_a.joints {
        let other = of_b.joints.iter().find(|other| other.name == joint.name);
        let other = other.ok_or_else(|| format!("joint `{}` is in one of the two alone", joint.name))?;
        joints(joint, other)?;
    }
    if let Some(joint) = of_b.joints.iter().find(|joint| of_a.joints.iter().all(|o| o.name != joint.name)) {
        return Err(format!("joint `{}` is in one of the two alone", joint.name));
    }
    Ok(())
}

/// Compares a joint of two robots; `Err` says what differs.
fn joints(a: &JointRecord, b: &JointRecord) -> Result<(), String> {
    let named = |what: String| format!("joint `{}`: {what}", a.name);
    if a.kind != b.kind {
        let hint = if a.kind == JointType::Fixed || b.kind == JointType::Fixed {
            " (held in one of the two)"
        } else {
            ""
        };
        return Err(named(format!("{} and {}{hint}", a.kind, b.kind)));
    }
    if (&a.parent, &a.child) != (&b.parent, &b.child) {
        return Err(named(format!(
            "from `{}` to `{}`, and from `{}` to `{}`",
            a.parent, a.child, b.parent, b.child
        )));
    }
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(x, y)| (x - y).abs() > SAME);
    if a.kind != JointType::Fixed && far(&a.axis, &b.axis) {
        return Err(named(format!("axis {:?} and {:?}", a.axis, b.axis)));
    }
    if far(&a.translation, &b.translation) {
        return Err(named(format!("origin {:?} and {:?} m", a.translation, b.translation)));
    }
    if far(a.rotation.as_flattened(), b.rotation.as_flattened()) {
        return Err(named("origins are turned against each other".to_owned()));
    }
    Ok(())
}

/// A remark where the two models stand under different gravity.
pub(super) fn gravity(sides: [&Side; 2]) -> Option<String> {
    let [Some(a), Some(b)] = sides.map(|side| side.estimate().map(|e| e.model.gravity)) else { return None };
    let differs = a.iter().zip(&b).any(|(x, y)| (x - y).abs() > SAME);
    differs.then(|| {
        format!("gravity is {a:?} m/s² in one and {b:?} m/s² in the other: efforts differ by that too")
    })
}
