//! `<equality>`: couplings of joints, and what closes loops.

use dynid_files::excerpt::closest;
use dynid_model::closed::{ClosureDescription, Condition, CutKind, LinkFrame};
use dynid_model::{JointKind, Mimic, Placement};

use super::compiler::Options;
use super::defaults::Defaults;
use super::document::Document;
use super::fields::Fields;
use super::model::{BodyFrame, Model, WORLD};
use super::orientation::rotation;
use super::{FLATTEN, REMOVE_OR_DISABLE};
use crate::robot_error::RobotFileError;

/// Puts the constraints of a model into it.
pub(super) fn read<'a>(
    document: &'a Document,
    defaults: &Defaults<'a>,
    options: &Options,
    model: &mut Model<'a>,
) -> Result<(), RobotFileError> {
    if !options.equalities {
        return Ok(());
    }
    for element in document.sections("equality").flat_map(|s| &s.children) {
        let fields = Fields::new(document, element, defaults.behind(element, None)?);
        if fields.flag("active")? == Some(false) {
            continue;
        }
        match element.name.as_str() {
            "joint" => coupling(&fields, model)?,
            "connect" => close(&fields, model, CutKind::Spherical)?,
            "weld" => close(&fields, model, CutKind::Fixed)?,
            _ => {
                let reason = "a constraint of this kind is not known here";
                return Err(fields.refuse("", reason, REMOVE_OR_DISABLE));
            }
        }
    }
    Ok(())
}

/// A joint that follows another, or that stands still.
fn coupling(fields: &Fields<'_>, model: &mut Model<'_>) -> Result<(), RobotFileError> {
    let polynomial = fields.filled("polycoef", [0.0, 1.0, 0.0, 0.0, 0.0])?;
    let follower = joint(fields, model, "joint1")?;
    let leader = if fields.has("joint2") { Some(joint(fields, model, "joint2")?) } else { None };
    if leader.is_some() && polynomial[2..].iter().any(|x| *x != 0.0) {
        let reason = "it couples joints by a polynomial of a higher degree, and couplings are linear here";
        return Err(fields.refuse("polycoef", reason, REMOVE_OR_DISABLE));
    }
    let zero = |k: usize, model: &Model<'_>| {
        let name = &model.description.joints[k].name;
        model.joints.iter().find(|j| j.parameters.joint == *name).map_or(0.0, |j| j.zero)
    };
    // Between positions counted from where the bodies are drawn.
    let start = zero(follower, model) + polynomial[0];
    let Some(leader) = leader else {
        let reason = "it holds a joint still, and joints move here";
        return Err(fields.refuse("joint1", reason, "remove the joint, or hold it by `[locked]` of a run"));
    };
    let (ratio, of) = (polynomial[1], model.description.joints[leader].name.clone());
    let offset = start - ratio * zero(leader, model);
    let follower = &mut model.description.joints[follower];
    if follower.mimic.is_some() {
        let reason = "its first joint follows another one already";
        return Err(fields.refuse("joint1", reason, REMOVE_OR_DISABLE));
    }
    follower.mimic = Some(Mimic { of, ratio, offset });
    Ok(())
}

/// The number of a joint with one coordinate.
fn joint(fields: &Fields<'_>, model: &Model<'_>, key: &str) -> Result<usize, RobotFileError> {
    let Some(name) = fields.text(key) else { return Err(fields.missing(format!("an attribute `{key}`"))) };
    let moving = |kind| !matches!(kind, JointKind::Fixed | JointKind::Floating);
    let joints = &model.description.joints;
    joints.iter().position(|j| j.name == name && moving(j.kind)).ok_or_else(|| {
        let known: Vec<&str> = joints.iter().filter(|j| moving(j.kind)).map(|j| j.name.as_str()).collect();
        fields.unknown(key, "joint", closest(name, &known))
    })
}

/// Two frames that meet.
fn close(fields: &Fields<'_>, model: &mut Model<'_>, kind: CutKind) -> Result<(), RobotFileError> {
    let (a, b, moves) = if fields.has("site1") || fields.has("site2") {
        let ((a, one), (b, other)) = (site(fields, model, "site1")?, site(fields, model, "site2")?);
        (a, b, one || other)
    } else {
        frames(fields, model, kind)?
    };
    if !moves {
        // What stands in the world stays there.
        return Ok(());
    }
    if a.link == b.link {
        let reason = "it holds a body to itself";
        return Err(fields.refuse("", reason, REMOVE_OR_DISABLE));
    }
    let plain = if kind == CutKind::Fixed { "weld" } else { "connect" };
    let name = fields.text("name").filter(|n| !n.is_empty()).map(str::to_owned);
    let name = name.unwrap_or_else(|| format!("{plain}{}", model.closures.len()));
    if model.closures.iter().any(|c| c.name == name) {
        return Err(fields.value("name", "the name of one constraint"));
    }
    model.closures.push(ClosureDescription { name, condition: Condition::Joint { kind, a, b } });
    Ok(())
}

/// Frames of `body1` and `body2`: at an anchor in the first where both are as drawn, or at a stated pose.
fn frames(
    fields: &Fields<'_>,
    model: &Model<'_>,
    kind: CutKind,
) -> Result<(LinkFrame, LinkFrame, bool), RobotFileError> {
    let one = body(fields, model, "body1")?;
    let other = if fields.has("body2") { body(fields, model, "body2")? } else { &model.frames[WORLD] };
    let relative = one.drawn.inverse().then(&other.drawn);
    let (at_one, at_other) = if kind == CutKind::Spherical {
        let anchor = fields.numbers("anchor")?;
        let [x, y, z] = anchor.ok_or_else(|| fields.missing("an attribute `anchor`".to_owned()))?;
        let anchor = Placement::translate(x, y, z);
        (anchor, relative.inverse().then(&anchor))
    } else {
        let [x, y, z, quat @ ..] = fields.filled("relpose", [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        let stated = quat.iter().any(|x| *x != 0.0);
        let pose = if stated {
            Placement { rotation: rotation(quat), ..Placement::translate(x, y, z) }
        } else {
            relative
        };
        (pose, Placement::identity())
    };
    let frame = |body: &BodyFrame, place: Placement| LinkFrame {
        link: body.link.clone(),
        placement: body.in_link.then(&place),
    };
    Ok((frame(one, at_one), frame(other, at_other), one.moves || other.moves))
}

fn body<'m>(fields: &Fields<'_>, model: &'m Model<'_>, key: &str) -> Result<&'m BodyFrame, RobotFileError> {
    let Some(name) = fields.text(key) else { return Err(fields.missing(format!("an attribute `{key}`"))) };
    let Some(frame) = model.frames.get(name) else {
        let known: Vec<&String> = model.frames.keys().collect();
        return Err(fields.unknown(key, "body", closest(name, &known)));
    };
    by_no_hand(fields, key, frame)?;
    Ok(frame)
}

fn site(fields: &Fields<'_>, model: &Model<'_>, key: &str) -> Result<(LinkFrame, bool), RobotFileError> {
    let Some(name) = fields.text(key) else { return Err(fields.missing(format!("an attribute `{key}`"))) };
    let Some((body, place)) = model.sites.get(name) else {
        let known: Vec<&String> = model.sites.keys().collect();
        return Err(fields.unknown(key, "site", closest(name, &known)));
    };
    let frame = &model.frames[body.as_str()];
    by_no_hand(fields, key, frame)?;
    Ok((LinkFrame { link: frame.link.clone(), placement: frame.in_link.then(place) }, frame.moves))
}

/// A body that a user moves by hand pulls at the robot.
fn by_no_hand(fields: &Fields<'_>, key: &str, frame: &BodyFrame) -> Result<(), RobotFileError> {
    if frame.mocap {
        let reason = format!("it ties the robot to `{}`, which is moved by hand (`mocap`)", frame.link);
        return Err(fields.refuse(key, reason, REMOVE_OR_DISABLE));
    }
    Ok(())
}

/// A closed pose of a mechanism with loops: that of the key `home`, or else the one that is drawn.
pub(super) fn home(document: &Document, model: &mut Model<'_>) -> Result<(), RobotFileError> {
    if model.closures.is_empty() {
        return Ok(());
    }
    let joints = || model.description.joints.iter().filter(|j| j.kind != JointKind::Fixed);
    let key = document
        .sections("keyframe")
        .flat_map(|s| &s.children)
        .find(|key| key.text("name") == Some("home") && key.attribute("qpos").is_some());
    let mut qpos: Option<std::vec::IntoIter<f64>> = None;
    if let Some(key) = key {
        let fields = Fields::alone(document, key);
        let needed = joints().map(|j| if j.kind == JointKind::Floating { 7 } else { 1 }).sum::<usize>();
        let words = fields.text("qpos").unwrap_or_default().split_ascii_whitespace();
        let numbers: Option<Vec<f64>> =
            words.map(|x| x.parse().ok().filter(|x: &f64| x.is_finite())).collect();
        let numbers = numbers.filter(|n| n.len() == needed);
        let expected = format!("{needed} finite numbers, the positions of all joints");
        qpos = Some(numbers.ok_or_else(|| fields.value("qpos", expected))?.into_iter());
    }
    let mut home = Vec::new();
    for joint in joints() {
        let drawn = model.joints.iter().find(|j| j.parameters.joint == joint.name).map_or(0.0, |j| j.zero);
        let mut next = || qpos.as_mut().and_then(Iterator::next);
        let values = if joint.kind == JointKind::Floating {
            let mut pose = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0];
            pose.iter_mut().for_each(|x| *x = next().unwrap_or(*x));
            let [x, y, z, w, i, j, k] = pose;
            vec![x, y, z, i, j, k, w]
        } else {
            vec![next().unwrap_or(drawn)]
        };
        home.push((joint.name.clone(), values));
    }
    home.sort_by(|a, b| a.0.cmp(&b.0));
    model.home = home;
    Ok(())
}

/// What tendons and deformable bodies do to the robot cannot be carried.
pub(super) fn refuse_others(document: &Document, defaults: &Defaults<'_>) -> Result<(), RobotFileError> {
    if let Some(element) = document.sections("deformable").flat_map(|s| &s.children).next() {
        let fields = Fields::alone(document, element);
        return Err(fields.refuse("", "bodies that give way are not known here", FLATTEN));
    }
    for element in document.sections("tendon").flat_map(|s| &s.children) {
        let fields = Fields::new(document, element, defaults.behind(element, None)?);
        for key in ["stiffness", "damping", "frictionloss", "armature"] {
            if fields.linear(key)? != 0.0 {
                let reason = format!("its `{key}` acts on the joints, and tendons are not known here");
                return Err(fields.refuse(key, reason, "remove the attribute, or state it at joints"));
            }
        }
    }
    Ok(())
}
