//! Joints of bodies.

use dynid_model::{JointKind, Limits, Placement, Vec3};

use super::compiler::{Compiler, Options};
use super::fields::Fields;
use super::{JointParameters, NO_LIMIT};
use crate::robot_error::RobotFileError;
use crate::robot_numbers::LEAST_LIMIT;

/// A joint that turns or slides, as its element states it.
pub(super) struct MovingJoint {
    pub(super) kind: JointKind,
    /// Point that it moves about, in the frame of its body, m.
    pub(super) anchor: Vec3<f64>,
    /// Axis in the frame of its body.
    pub(super) axis: Vec3<f64>,
    /// Its position where the body is as drawn, rad or m.
    pub(super) zero: f64,
    pub(super) limits: Limits,
    /// Friction and rotor; its name is still to be given.
    pub(super) parameters: JointParameters,
    /// Radians, or metres, of the numbers of its element.
    pub(super) unit: f64,
}

/// What a joint element is.
pub(super) enum JointElement {
    Free,
    Moving(Box<MovingJoint>),
}

/// Reads a joint; `frame` is where frames around it put it.
pub(super) fn read(
    fields: &Fields<'_>,
    frame: &Placement,
    compiler: &Compiler<'_>,
    options: &Options,
) -> Result<JointElement, RobotFileError> {
    if fields.element.name == "freejoint" {
        return Ok(JointElement::Free);
    }
    let turns = match fields.text("type") {
        None | Some("hinge") => true,
        Some("slide") => false,
        Some("free") => return free(fields),
        Some("ball") => {
            let reason = "it is a ball joint, and joints have one coordinate, or six, here";
            let hint = "write three hinges in the body, about axes at right angles";
            return Err(fields.refuse("type", reason, hint));
        }
        Some(_) => return Err(fields.value("type", "free, ball, slide or hinge")),
    };
    let unit = |x: f64| if turns { compiler.angle(x) } else { x };
    let axis = Vec3(fields.numbers("axis")?.unwrap_or([0.0, 0.0, 1.0]));
    let norm = axis.norm();
    if norm < 1e-14 {
        return Err(fields.value("axis", "a direction, not zero"));
    }
    let range = range(fields)?;
    let limited = match fields.flag("limited")? {
        Some(limited) => limited,
        None if !compiler.limits_follow_ranges && range.is_some() => {
            let reason = "it has a `range`, and `autolimits=\"false\"` leaves open whether it is a limit";
            return Err(fields.refuse("range", reason, "write `limited=\"true\"` or `limited=\"false\"`"));
        }
        None => range.is_some(),
    };
    let position = range.filter(|_| limited).map(|(low, high)| (unit(low), unit(high)));
    let kind = match (turns, position) {
        (true, Some(_)) => JointKind::Revolute,
        (true, None) => JointKind::Continuous,
        (false, _) => JointKind::Prismatic,
    };
    let effort = limit(fields, "actuatorfrcrange", "actuatorfrclimited")?;
    if fields.filled("springdamper", [0.0; 2])?.iter().any(|x| *x > 0.0) {
        let reason = "`springdamper` stands for a stiffness and a damping that follow from the inertia";
        return Err(fields.refuse("springdamper", reason, "state `stiffness` and `damping`"));
    }
    let parameter = |key: &str| fields.not_negative(key, fields.number(key, 0.0)?);
    let stiffness = fields.not_negative("stiffness", fields.linear("stiffness")?)?;
    let stiffness = if options.springs { stiffness } else { 0.0 };
    let reference = unit(fields.number("springref", 0.0)?);
    let parameters = JointParameters {
        joint: String::new(),
        damping: if options.dampers {
            fields.not_negative("damping", fields.linear("damping")?)?
        } else {
            0.0
        },
        friction_loss: if options.friction { parameter("frictionloss")? } else { 0.0 },
        armature: parameter("armature")?,
        stiffness,
        spring_reference: if stiffness > 0.0 { reference } else { 0.0 },
        sticks: false,
        gear: None,
    };
    Ok(JointElement::Moving(Box::new(MovingJoint {
        kind,
        anchor: frame.rotation.mul_vec(fields.vector("pos")?) + frame.translation,
        axis: frame.rotation.mul_vec(axis.scale(1.0 / norm)),
        zero: unit(fields.number("ref", 0.0)?),
        limits: Limits { position, velocity: None, effort },
        parameters,
        unit: unit(1.0),
    })))
}

/// A free joint may have none of what joints have here.
fn free(fields: &Fields<'_>) -> Result<JointElement, RobotFileError> {
    for key in ["armature", "damping", "frictionloss", "stiffness"] {
        if fields.linear(key)? != 0.0 {
            let reason = format!("`{key}` acts on a free joint, which has no elements here");
            return Err(fields.refuse(key, reason, "write <freejoint/>, which inherits nothing"));
        }
    }
    Ok(JointElement::Free)
}

/// Least and largest position that are stated; where one is beyond all reason there is no limit.
fn range(fields: &Fields<'_>) -> Result<Option<(f64, f64)>, RobotFileError> {
    Ok(pair(fields, "range")?
        .filter(|(low, high)| low.abs() < NO_LIMIT && high.abs() < NO_LIMIT && low < high))
}

/// Two numbers, which may be infinite. Two zeros are no statement.
pub(super) fn pair(fields: &Fields<'_>, key: &str) -> Result<Option<(f64, f64)>, RobotFileError> {
    let Some(text) = fields.text(key) else { return Ok(None) };
    let numbers: Option<Vec<f64>> =
        text.split_ascii_whitespace().map(|x| x.parse().ok().filter(|x: &f64| !x.is_nan())).collect();
    match numbers.as_deref() {
        Some([low, high]) if low <= high => Ok((*low != 0.0 || *high != 0.0).then_some((*low, *high))),
        _ => Err(fields.value(key, "two numbers, the lower first")),
    }
}

/// The largest magnitude of a range that limits something, if it does.
pub(super) fn limit(fields: &Fields<'_>, range: &str, limited: &str) -> Result<Option<f64>, RobotFileError> {
    let largest = pair(fields, range)?.map(|(low, high)| low.abs().max(high.abs()));
    let limits = fields.flag(limited)?.unwrap_or(true);
    Ok(largest.filter(|x| limits && (LEAST_LIMIT..NO_LIMIT).contains(x)))
}
