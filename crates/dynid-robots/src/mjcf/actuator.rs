//! `<actuator>`: which joints are driven, and how hard.

use dynid_files::excerpt::closest;

use super::defaults::{ACTUATORS, Defaults};
use super::document::Document;
use super::fields::Fields;
use super::joint::{limit, pair};
use super::model::Model;
use super::{NO_LIMIT, PositionActuator};
use crate::robot_error::RobotFileError;
use crate::robot_numbers::LEAST_LIMIT;

/// Puts what actuators say of joints into a model. Their gains, delays and controllers belong to the drive: efforts of logs are what
/// they make, and position loops are kept beside for fits of drives.
pub(super) fn read<'a>(
    document: &'a Document,
    defaults: &Defaults<'a>,
    model: &mut Model<'a>,
) -> Result<(), RobotFileError> {
    let all = document.sections("actuator").flat_map(|s| &s.children);
    for element in all.filter(|e| ACTUATORS.contains(&e.name.as_str())) {
        let fields = Fields::new(document, element, defaults.behind(element, None)?);
        for key in ["armature", "damping"] {
            if fields.linear(key)? != 0.0 {
                let reason =
                    format!("its own `{key}` acts on what it drives, and joints alone have one here");
                let hint = "state it at the joint, multiplied by the square of the gear";
                return Err(fields.refuse(key, reason, hint));
            }
        }
        let Some(key) = fields.first(&["joint", "jointinparent"]) else {
            if let Some(key) = fields.first(&["tendon", "site", "body", "slidersite"]) {
                let name = fields.owner();
                model.warnings.push(format!(
                    "{name} drives a {}, not a joint: efforts are those of the joints",
                    key.trim_start_matches("slider")
                ));
            }
            continue;
        };
        let name = fields.text(key).unwrap_or_default();
        let joints = &mut model.description.joints;
        let Some(joint) = joints.iter_mut().find(|j| j.name == name) else {
            let known: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
            return Err(fields.unknown(key, "joint", closest(name, &known)));
        };
        let [gear, ..] = fields.filled("gear", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
        let force = limit(&fields, "forcerange", "forcelimited")?;
        // The control of a motor is its force.
        let control = limit(&fields, "ctrlrange", "ctrllimited")?.filter(|_| element.name == "motor");
        let most = force.unwrap_or(f64::INFINITY).min(control.unwrap_or(f64::INFINITY)) * gear.abs();
        if joint.limits.effort.is_none() && (LEAST_LIMIT..NO_LIMIT).contains(&most) {
            joint.limits.effort = Some(most);
        }
        if !model.driven.contains(&joint.name) {
            model.driven.push(joint.name.clone());
        }
        if let Some((position_gain, velocity_gain, offset)) = position_loop(&fields, &element.name)?
            && gear == 1.0
        {
            let clamps = fields.flag("ctrllimited")?.unwrap_or(true);
            model.position_actuators.push(PositionActuator {
                joint: name.to_owned(),
                position_gain,
                velocity_gain,
                offset,
                effort_limit: force,
                command_limits: pair(&fields, "ctrlrange")?.filter(|_| clamps),
            });
        }
    }
    Ok(())
}

/// Position gain, velocity gain and constant force of an actuator that closes a position loop without a lag of its own.
fn position_loop(fields: &Fields<'_>, kind: &str) -> Result<Option<(f64, f64, f64)>, RobotFileError> {
    match kind {
        // Damping by a ratio hangs on the inertia of all that moves.
        "position" if fields.number("dampratio", 0.0)? == 0.0 && fields.number("timeconst", 0.0)? == 0.0 => {
            Ok(Some((fields.number("kp", 1.0)?, fields.number("kv", 0.0)?, 0.0)))
        }
        "general" => {
            let plain = |key: &str, usual: &str| fields.text(key).unwrap_or(usual) == usual;
            let affine = fields.text("biastype") == Some("affine");
            if !affine || !plain("gaintype", "fixed") || !plain("dyntype", "none") {
                return Ok(None);
            }
            let [gain, ..] = fields.filled("gainprm", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
            let [offset, by_position, by_velocity, ..] =
                fields.filled("biasprm", [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])?;
            let closes = gain > 0.0 && by_position == -gain && by_velocity <= 0.0;
            Ok(closes.then_some((gain, -by_velocity, offset)))
        }
        _ => Ok(None),
    }
}
