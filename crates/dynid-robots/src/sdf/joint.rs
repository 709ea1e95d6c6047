//! `<joint>`: kind, axis, limits, friction.

use dynid_files::excerpt::excerpt;
use dynid_model::{JointKind, Limits, Mimic, Placement, Vec3};

use super::document::{Document, Element};
use super::frames::{Frames, MODEL};
use crate::robot_error::RobotFileError;
use crate::robot_numbers::{LEAST_LIMIT, in_range};

/// Positions beyond stand for no limit, rad or m: `1e16` is SDF's own.
const NO_LIMIT: f64 = 1e12;

/// A joint as its element states it.
pub(super) struct StatedJoint {
    pub(super) kind: JointKind,
    /// Axis in the frame of the joint.
    pub(super) axis: [f64; 3],
    pub(super) limits: Limits,
    /// Whether one end of its range alone is limited, for which there is no place.
    pub(super) one_end: bool,
    pub(super) mimic: Option<Mimic>,
    /// Viscous friction, N m s/rad or N s/m.
    pub(super) damping: f64,
    /// Coulomb friction, N m or N.
    pub(super) friction: f64,
    /// Stiffness and rest position of a spring, if it has one.
    pub(super) spring: Option<(f64, f64)>,
}

/// Version of SDF, `major` and `minor`.
pub(super) type Version = (u32, u32);

/// Reads a joint whose frame has the given place in the model.
pub(super) fn read(
    document: &Document<'_>,
    frames: &Frames<'_>,
    joint: &Element,
    (name, place): (&str, Placement),
    version: Version,
) -> Result<StatedJoint, RobotFileError> {
    let owner = format!("joint `{}`", excerpt(name));
    let (turns, kind) = match joint.attribute("type") {
        Some("revolute") => (true, JointKind::Revolute),
        Some("continuous") => (true, JointKind::Continuous),
        Some("prismatic") => (false, JointKind::Prismatic),
        Some("fixed") => (false, JointKind::Fixed),
        Some(other @ ("ball" | "universal" | "revolute2" | "screw" | "gearbox")) => {
            let reason = format!("it is of the type {other}, and joints turn or slide about one axis here");
            let hint = "write it as revolute or prismatic joints with massless links between them";
            return Err(document.refuse(joint, &owner, reason, hint));
        }
        other => {
            return Err(RobotFileError::Value {
                at: document.place(joint),
                owner,
                field: "type".to_owned(),
                expected: "revolute, continuous, prismatic or fixed".to_owned(),
                found: excerpt(other.unwrap_or("nothing")),
            });
        }
    };
    let mut stated = StatedJoint {
        kind,
        axis: [0.0, 0.0, 1.0],
        limits: Limits::default(),
        one_end: false,
        mimic: None,
        damping: 0.0,
        friction: 0.0,
        spring: None,
    };
    if kind == JointKind::Fixed {
        return Ok(stated);
    }
    let Some(axis) = document.child(joint, &owner, "axis")? else { return Ok(stated) };
    stated.axis = direction(document, frames, axis, &owner, (place, version))?;
    limits(document, axis, &owner, turns, &mut stated)?;
    dynamics(document, axis, &owner, &mut stated)?;
    stated.mimic = mimic(document, axis, &owner)?;
    Ok(stated)
}

/// The axis in the frame of its joint.
fn direction(
    document: &Document<'_>,
    frames: &Frames<'_>,
    axis: &Element,
    owner: &str,
    (place, version): (Placement, Version),
) -> Result<[f64; 3], RobotFileError> {
    let in_model = document.flag(axis, owner, "use_parent_model_frame")?;
    if in_model == Some(true) && version >= (1, 7) {
        let reason = "<use_parent_model_frame> has no meaning since SDF 1.7";
        return Err(document.refuse(axis, owner, reason, "write <xyz expressed_in=\"__model__\">"));
    }
    // The first versions stated axes in the frame of the model.
    let in_model = in_model.unwrap_or(version <= (1, 4));
    let xyz = document.child(axis, owner, "xyz")?;
    let (numbers, stated_in) = match xyz {
        Some(xyz) if !xyz.text.is_empty() => {
            let numbers = document.numbers(xyz, owner, 3)?;
            (Vec3([numbers[0], numbers[1], numbers[2]]), xyz.attribute("expressed_in"))
        }
        other => (Vec3([0.0, 0.0, 1.0]), other.and_then(|xyz| xyz.attribute("expressed_in"))),
    };
    if numbers.norm() < 1e-14 {
        return Err(document.value(xyz.unwrap_or(axis), owner, "a direction, not zero"));
    }
    let frame = stated_in.or(in_model.then_some(MODEL));
    let Some(frame) = frame else { return Ok(numbers.0) };
    let rotation = frames.place(frame, xyz.unwrap_or(axis), owner)?.rotation;
    let turned = place.rotation.tr_mul_vec(rotation.mul_vec(numbers.scale(1.0 / numbers.norm())));
    Ok(turned.0.map(|x| in_range(x).unwrap_or_default()))
}

fn limits(
    document: &Document<'_>,
    axis: &Element,
    owner: &str,
    turns: bool,
    stated: &mut StatedJoint,
) -> Result<(), RobotFileError> {
    let Some(limit) = document.child(axis, owner, "limit")? else {
        stated.kind = if turns { JointKind::Continuous } else { stated.kind };
        return Ok(());
    };
    // Infinity says that there is no limit, as 1e16 does.
    let end = |name: &str, without: f64| -> Result<f64, RobotFileError> {
        let Some(child) = document.child(limit, owner, name)? else { return Ok(without) };
        let number = child.text.parse::<f64>().ok().filter(|x| !x.is_nan());
        let number = number.map(|x| if x.is_subnormal() { 0.0 } else { x });
        number.ok_or_else(|| document.value(child, owner, "a number"))
    };
    let (lower, upper) = (end("lower", -1e16)?, end("upper", 1e16)?);
    if lower > upper {
        return Err(document.value(limit.all("lower").next().unwrap_or(limit), owner, "lower <= upper"));
    }
    let ends = [lower, upper].map(|x| (x.abs() < NO_LIMIT).then_some(x));
    stated.limits.position = match ends {
        [None, None] => None,
        [Some(lower), Some(upper)] => Some((lower, upper)),
        _ => {
            stated.one_end = true;
            None
        }
    };
    if turns {
        let is_limited = stated.limits.position.is_some() && stated.kind == JointKind::Revolute;
        stated.kind = if is_limited { JointKind::Revolute } else { JointKind::Continuous };
        stated.limits.position = stated.limits.position.filter(|_| is_limited);
    }
    // Negative and infinite ones are SDF's way to state none.
    let positive = |name: &str| -> Result<Option<f64>, RobotFileError> {
        let found = end(name, -1.0)?;
        match found {
            _ if found <= 0.0 || found >= NO_LIMIT => Ok(None),
            _ if found < LEAST_LIMIT => {
                let expected = format!("-1 (no limit) or at least {LEAST_LIMIT:e}");
                Err(document.value(limit.all(name).next().unwrap_or(limit), owner, &expected))
            }
            _ => Ok(Some(found)),
        }
    };
    stated.limits.velocity = positive("velocity")?;
    stated.limits.effort = positive("effort")?;
    Ok(())
}

fn dynamics(
    document: &Document<'_>,
    axis: &Element,
    owner: &str,
    stated: &mut StatedJoint,
) -> Result<(), RobotFileError> {
    let Some(dynamics) = document.child(axis, owner, "dynamics")? else { return Ok(()) };
    let not_negative = |name: &str| -> Result<f64, RobotFileError> {
        match document.number(dynamics, owner, name)? {
            Some(x) if x < 0.0 => Err(document.value(
                dynamics.all(name).next().unwrap_or(dynamics),
                owner,
                "a number that is not negative",
            )),
            found => Ok(found.unwrap_or(0.0)),
        }
    };
    stated.damping = not_negative("damping")?;
    stated.friction = not_negative("friction")?;
    let stiffness = not_negative("spring_stiffness")?;
    let rest = document.number(dynamics, owner, "spring_reference")?.unwrap_or(0.0);
    stated.spring = (stiffness > 0.0).then_some((stiffness, rest));
    Ok(())
}

/// `position = multiplier · (leader - reference) + offset`.
fn mimic(document: &Document<'_>, axis: &Element, owner: &str) -> Result<Option<Mimic>, RobotFileError> {
    let Some(mimic) = document.child(axis, owner, "mimic")? else { return Ok(None) };
    let Some(of) = mimic.attribute("joint").map(str::to_owned) else {
        let (at, owner) = (document.place(mimic), owner.to_owned());
        return Err(RobotFileError::Missing {
            at,
            owner,
            expected: "an attribute `joint` of <mimic>".to_owned(),
        });
    };
    if mimic.attribute("axis").is_some_and(|axis| axis != "axis") {
        let reason = "it follows the second axis of a joint";
        return Err(document.refuse(mimic, owner, reason, "joints have one axis here"));
    }
    let number = |name: &str, without: f64| Ok(document.number(mimic, owner, name)?.unwrap_or(without));
    let (ratio, offset, reference) =
        (number("multiplier", 1.0)?, number("offset", 0.0)?, number("reference", 0.0)?);
    let Some(offset) = in_range(offset - ratio * reference) else {
        return Err(document.refuse(mimic, owner, "its offset overflows", "correct its numbers"));
    };
    Ok(Some(Mimic { of, ratio, offset }))
}
