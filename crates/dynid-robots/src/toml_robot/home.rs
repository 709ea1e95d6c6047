//! Home position of a robot file.

use std::collections::BTreeMap;

use dynid_model::mechanism::ROOT_JOINT;
use dynid_model::{Description, JointKind};
use toml::Spanned;

use super::Source;
use super::number::Position;
use crate::robot_error::RobotFileError;

const KEY: &str = "home";

/// How far the length of a quaternion may be from 1: three digits are typed.
const UNIT: f64 = 1e-3;

pub(super) fn build(
    source: &Source<'_>,
    stated: &BTreeMap<Spanned<String>, Position>,
    description: &Description,
) -> Result<Vec<(String, Vec<f64>)>, RobotFileError> {
    let root = description.floating_base.then_some((ROOT_JOINT, JointKind::Floating));
    let joints = description.joints.iter().map(|j| (j.name.as_str(), j.kind));
    let joints: Vec<(&str, JointKind)> = joints.chain(root).collect();
    let known: Vec<&str> = joints.iter().map(|(name, _)| *name).collect();
    let mut home = Vec::new();
    for (name, Position(values)) in stated {
        let (offset, name) = (name.span().start, name.get_ref());
        source.known(offset, KEY, "joint", name, &known)?;
        let kind = joints.iter().find(|(joint, _)| joint == name).map(|(_, kind)| *kind);
        let (expected, fits) = match kind {
            Some(JointKind::Fixed) => ("no value of a joint that does not move", false),
            Some(JointKind::Floating) => (
                "seven numbers x y z qx qy qz qw with a quaternion of length 1",
                values.len() == 7
                    && (values[3..].iter().map(|x| x * x).sum::<f64>().sqrt() - 1.0).abs() < UNIT,
            ),
            _ => ("one number (rad, m)", values.len() == 1),
        };
        if !fits {
            let found = values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
            return Err(source.value(offset, KEY, name, expected, &found));
        }
        home.push((name.clone(), values.clone()));
    }
    Ok(home)
}
