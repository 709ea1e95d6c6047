//! A robot with stiff joints in place of elastic ones, and its logs read at the motors.

use std::collections::BTreeMap;

use dynid_logs::ColumnMapping;
use dynid_logs::columns::ColumnUse;
use dynid_motion::{Channel, JointSignals};
use dynid_robots::{ElasticSpec, ElementSetting, SettingValue};

use crate::Error;
use crate::log::{Log, understood};
use crate::robot::Robot;
use crate::settings::Settings;

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

/// Settings of an elastic robot for the same robot with stiff joints: joints have the elements of their motors too.
pub(crate) fn stiff_settings(settings: &Settings, robot: &Robot) -> Settings {
    let mut out = settings.clone();
    let lists: &mut BTreeMap<String, Vec<String>> = &mut out.elements.joint;
    for spec in &robot.elements.elastic {
        if let Some(of_motor) = lists.remove(&spec.motor) {
            let own = lists.remove(&spec.joint).unwrap_or_default();
            lists.insert(spec.joint.clone(), union(&own, &of_motor));
        }
    }
    out
}

/// Ends the name of the channel that holds the position of a link.
pub(crate) const BEHIND_GEAR: &str = " behind its gear";

/// A log of an elastic robot for the same robot with stiff joints: positions and efforts are those of the motors, on the side of the
/// joints. `links`: positions of the links become channels, the names of their joints before [`BEHIND_GEAR`].
///
/// # Errors
/// [`Error::Log`].
pub(crate) fn at_motors(log: Log, elastic: &[ElasticSpec], links: bool) -> Result<Log, Error> {
    let name = log.log.name().to_owned();
    let mapping = log.source.mapping.as_ref().map(|mapping| mapping_at_motors(mapping, elastic));
    let columns = mapping.as_ref().map_or_else(|| log.source.columns.clone(), understood);
    let mut log = log.map_signals(|signals| signals_at_motors(name, signals, elastic, links))?;
    (log.source.mapping, log.source.columns) = (mapping, columns);
    Ok(log)
}

fn signals_at_motors(
    name: String,
    signals: dynid_motion::Log,
    elastic: &[ElasticSpec],
    links: bool,
) -> Result<dynid_motion::Log, Error> {
    let (time, joints, mut channels) = signals.into_parts();
    let of_motor = |joint: &str| elastic.iter().find(|spec| spec.joint == joint);
    let is_motor = |joint: &JointSignals| elastic.iter().any(|spec| spec.motor == joint.name);
    let scaled = |signal: &[f64], factor: f64| signal.iter().map(|x| x * factor).collect::<Vec<f64>>();
    let kept = joints.iter().filter(|joint| !is_motor(joint)).map(|joint| {
        let spec = of_motor(&joint.name);
        let motor = spec.and_then(|spec| Some((joints.iter().find(|j| j.name == spec.motor)?, spec.ratio)));
        match motor {
            None => joint.clone(),
            Some((motor, ratio)) => JointSignals {
                name: joint.name.clone(),
                position: scaled(&motor.position, 1.0 / ratio),
                velocity: motor.velocity.as_ref().map(|v| scaled(v, 1.0 / ratio)),
                effort: scaled(&motor.effort, ratio),
            },
        }
    });
    let kept = kept.collect();
    let link = |spec: &ElasticSpec| {
        let joint = joints.iter().find(|joint| joint.name == spec.joint)?;
        Some(Channel { name: format!("{}{BEHIND_GEAR}", spec.joint), values: joint.position.clone() })
    };
    channels.extend(elastic.iter().filter(|_| links).filter_map(link));
    Ok(dynid_motion::Log::new(name, time, kept, channels)?)
}

/// The columns of a log of an elastic robot as those of the same robot with stiff joints.
fn mapping_at_motors(mapping: &ColumnMapping, elastic: &[ElasticSpec]) -> ColumnMapping {
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
    ColumnMapping {
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
    }
}
