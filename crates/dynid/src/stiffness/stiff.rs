//! A robot with stiff joints in place of elastic ones, and its logs read at the motors.

use std::collections::BTreeMap;

use dynid_io::columns::ColumnUse;
use dynid_io::{ColumnMapping, ElasticSpec, ElementSetting, MappingSpec, SettingValue};

use crate::config::{Config, LogConfig};
use crate::robot::Robot;
use crate::{Error, logs};

/// Settings of motors that a joint takes over, with the power of the ratio that carries them to its side.
const CARRIED: [(&str, &str, i32); 3] =
    [("rotor", "inertia", 2), ("coulomb", "effort", 1), ("viscous", "coefficient", 2)];

/// A robot whose joints with springs are stiff: elements of the motors act at the joints.
///
/// # Errors
/// Fails as [`Robot::load`] does.
pub(crate) fn stiff_robot(robot: &Robot) -> Result<Robot, Error> {
    robot.changed(|file| {
        let elements = &mut file.elements;
        for spec in std::mem::take(&mut elements.elastic) {
            let own = |name: &str| elements.per_joint.iter().position(|(joint, _)| joint == name);
            let lists = [own(&spec.joint), own(&spec.motor)];
            let defaults = || crate::elements::DEFAULTS.map(str::to_owned).to_vec();
            let list = |at: Option<usize>| match at {
                Some(k) => elements.per_joint[k].1.clone(),
                None if elements.defaults.is_empty() => defaults(),
                None => elements.defaults.clone(),
            };
            if lists.iter().any(Option::is_some) {
                let both = union(&list(lists[0]), &list(lists[1]));
                elements.per_joint.retain(|(joint, _)| *joint != spec.joint && *joint != spec.motor);
                elements.per_joint.push((spec.joint.clone(), both));
            }
            carry(&mut elements.settings, &spec);
        }
    })
}

fn union(a: &[String], b: &[String]) -> Vec<String> {
    let mut out: Vec<String> = a.to_vec();
    out.extend(b.iter().filter(|name| !a.contains(name)).cloned());
    out.retain(|name| name != crate::elements::ELASTIC);
    out
}

/// Moves what is stated of a motor to its joint, as far as it has a meaning there.
fn carry(settings: &mut Vec<ElementSetting>, spec: &ElasticSpec) {
    let (of_motor, mut rest): (Vec<_>, Vec<_>) =
        std::mem::take(settings).into_iter().partition(|s| s.joint == spec.motor);
    for setting in of_motor {
        let carried = CARRIED.iter().find(|(e, key, _)| *e == setting.element && *key == setting.key);
        let (Some((_, _, power)), SettingValue::Number(value)) = (carried, &setting.value) else { continue };
        let value = value * spec.ratio.abs().powi(*power);
        let same = |s: &&mut ElementSetting| {
            s.joint == spec.joint && s.element == setting.element && s.key == setting.key
        };
        match rest.iter_mut().find(same) {
            Some(ElementSetting { value: SettingValue::Number(own), .. }) => *own += value,
            Some(_) => {}
            None => rest.push(ElementSetting {
                joint: spec.joint.clone(),
                value: SettingValue::Number(value),
                ..setting
            }),
        }
    }
    *settings = rest;
}

/// The configuration that reads the logs of an elastic robot for the same robot with stiff joints: positions and efforts
/// are those of the motors, on the side of the joints.
///
/// # Errors
/// Fails as [`logs::load`] does.
pub(crate) fn stiff_config(config: &Config, robot: &Robot) -> Result<Config, Error> {
    let mut out = config.clone();
    let read = |log: &mut LogConfig| -> Result<(), Error> {
        let loaded = logs::load(log, &robot.axes, &config.columns, config.motor_side.as_ref())?;
        let stated = log.columns.as_ref().unwrap_or(&config.columns);
        log.columns = Some(at_motors(&loaded.mapping, &robot.elements.elastic).read_as(stated));
        Ok(())
    };
    out.log.iter_mut().chain(&mut out.validation).try_for_each(read)?;
    let lists: &mut BTreeMap<String, Vec<String>> = &mut out.elements.joint;
    for spec in &robot.elements.elastic {
        if let Some(of_motor) = lists.remove(&spec.motor) {
            let own = lists.remove(&spec.joint).unwrap_or_default();
            lists.insert(spec.joint.clone(), union(&own, &of_motor));
        }
    }
    Ok(out)
}

fn at_motors(mapping: &ColumnMapping, elastic: &[ElasticSpec]) -> MappingSpec {
    let place = |name: &String| mapping.joints.iter().position(|j| j == name);
    let kept: Vec<usize> = (0..mapping.joints.len())
        .filter(|k| !elastic.iter().any(|e| e.motor == mapping.joints[*k]))
        .collect();
    // Per joint: where its column stands, and what carries it to the joint's side.
    let source = |k: usize| {
        let spec = elastic.iter().find(|e| e.joint == mapping.joints[k])?;
        Some((place(&spec.motor)?, spec.ratio))
    };
    let list = |columns: &[Option<ColumnUse>], carried: fn(f64) -> f64| -> Vec<Option<ColumnUse>> {
        let one = |k: &usize| match source(*k) {
            None => columns[*k].clone(),
            Some((motor, ratio)) => columns[motor].clone().map(|c| ColumnUse {
                factor: c.factor * carried(ratio),
                offset: c.offset * carried(ratio),
                ..c
            }),
        };
        kept.iter().map(one).collect()
    };
    let motion: fn(f64) -> f64 = |ratio| 1.0 / ratio;
    let at_joints = ColumnMapping {
        joints: kept.iter().map(|k| mapping.joints[*k].clone()).collect(),
        time: mapping.time.clone(),
        position: list(&mapping.position, motion),
        velocity: mapping.velocity.as_ref().map(|c| list(c, motion)),
        acceleration: mapping.acceleration.as_ref().map(|c| list(c, motion)),
        effort: mapping.effort.as_ref().map(|c| list(c, |ratio| ratio)),
        temperature: mapping.temperature.as_ref().map(|c| list(c, |_| 1.0)),
        undriven: kept.iter().map(|k| mapping.undriven[*k] && source(*k).is_none()).collect(),
        channels: mapping.channels.clone(),
        missing: mapping.missing,
    };
    MappingSpec::from(&at_joints)
}
