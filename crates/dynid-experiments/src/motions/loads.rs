//! Loads beside the drives, as columns.

use dynid_identify::Error;
use dynid_identify::elements::ElementPlan;
use dynid_identify::robot::Robot;
use dynid_identify::settings::known;
use dynid_model::EffortModel;
use dynid_model::element::load_channel;
use dynid_robots::SettingValue;
use dynid_sim::Profile;

use super::config::{LoadConfig, MotionConfig};
use super::record::{LoadRecord, PartRecord};

/// Name of the element that reads loads.
const ELEMENT: &str = "external_load";

/// Columns of loads at `time`, with what is told of them.
pub(super) fn loads(
    robot: &Robot,
    config: &MotionConfig,
    parts: &[PartRecord],
    time: &[f64],
) -> Result<Vec<(LoadRecord, Vec<f64>)>, Error> {
    if config.load.is_empty() {
        return Ok(Vec::new());
    }
    let mechanism = &robot.mechanism;
    let plan = ElementPlan::new(mechanism, &robot.elements.with_ideal_bearings(), None, |rate| {
        robot.is_driven(rate)
    })?
    .with_loops(robot.closed.clone());
    let model = plan.model(mechanism)?;
    let joints = robot.rate_names();
    let of_load = |(k, load): (usize, &LoadConfig)| {
        known(&load.joint, &joints)?;
        let column = load_channel(&load.joint);
        let is_read = model.channels().contains(&column);
        if is_read && load.brake != is_brake(robot, &load.joint) {
            let expected = match load.brake {
                true => "`brake = true` in `external_load` of the robot file as well",
                false => "no `brake = true` in `external_load` of the robot file either",
            };
            let found = format!("brake = {}", !load.brake);
            return Err(Error::setting(&format!("load {}: brake", k + 1), expected, found));
        }
        let profile = Profile::new(points(load, parts, config.sample_rate_hz))?;
        let values: Vec<f64> = time.iter().map(|t| profile.at(*t)).collect();
        let (least, most) = (
            values.iter().copied().fold(f64::INFINITY, f64::min),
            values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        );
        let record =
            LoadRecord { joint: load.joint.clone(), column, brake: load.brake, least, most, is_read };
        Ok((record, values))
    };
    config.load.iter().enumerate().map(of_load).collect()
}

/// Whether the robot file says that the load of a joint is a brake's.
fn is_brake(robot: &Robot, joint: &str) -> bool {
    let settings = robot.elements.settings.iter();
    let mut own = settings.filter(|s| s.joint == joint && s.element == ELEMENT && s.key == "brake");
    own.any(|s| s.value == SettingValue::Flag(true))
}

/// Times and loads of a schedule.
fn points(load: &LoadConfig, parts: &[PartRecord], rate_hz: f64) -> Vec<(f64, f64)> {
    if load.by_part.is_empty() {
        return load.points.iter().map(|[t, x]| (*t, *x)).collect();
    }
    let mut out: Vec<(f64, f64)> = Vec::with_capacity(2 * parts.len());
    for (part, value) in parts.iter().zip(&load.by_part) {
        // Where one part follows the other at once, the load changes within a sample.
        let after = out.last().map_or(part.from_s, |(t, _)| part.from_s.max(t + 0.5 / rate_hz));
        out.push((after, *value));
        out.push((part.to_s.max(after + 0.5 / rate_hz), *value));
    }
    out
}

/// What a user should know of a load that no element of the robot file reads.
pub(super) fn unread(load: &LoadRecord) -> Option<String> {
    let brake = if load.brake { ", brake = true" } else { "" };
    (!load.is_read).then(|| {
        format!(
            "no element of the robot file reads `{}`: before `dynid simulate` follows the file, put `external_load` among the elements of \
             `{}` there, with `external_load = {{ factor = 1{brake} }}` under `[element.{}]`",
            load.column, load.joint, load.joint
        )
    })
}
