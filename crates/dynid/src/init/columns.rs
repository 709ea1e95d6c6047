//! Columns as a configuration states them.

use dynid_logs::ColumnMapping;
use dynid_logs::columns::{ColumnNames, ColumnUse, SignalSpec};

use super::question::in_unit;
use crate::log::Log;
use crate::logs::mapping_of;

/// Least ratio of logged velocities to those of positions for the two to be in the same unit, and its inverse the most.
const SAME_UNIT: f64 = 0.5;

/// Positions in degrees, and velocities in degrees per second where these agree with positions as they stand in the file.
pub(super) fn in_degrees(loaded: &Log) -> (SignalSpec, Option<SignalSpec>) {
    let names = |columns: &[Option<ColumnUse>]| {
        ColumnNames::List(
            columns.iter().map(|c| c.as_ref().map_or_else(String::new, |c| c.name.clone())).collect(),
        )
    };
    let position = in_unit(names(&mapping_of(loaded).position), "deg");
    let velocity = mapping_of(loaded)
        .velocity
        .as_ref()
        .map(|columns| in_unit(names(columns), if velocities_follow(loaded) { "deg/s" } else { "rad/s" }));
    (position, velocity)
}

/// Whether logged velocities are the rates of the positions in the units that both are taken to have.
fn velocities_follow(loaded: &Log) -> bool {
    let time = loaded.log.time();
    let (mut vv, mut dd) = (0.0, 0.0);
    for joint in loaded.log.joints() {
        let Some(velocity) = &joint.velocity else { continue };
        for k in 1..time.len() {
            let slope = (joint.position[k] - joint.position[k - 1]) / (time[k] - time[k - 1]);
            if slope.is_finite() {
                (vv, dd) = (vv + velocity[k] * velocity[k], dd + slope * slope);
            }
        }
    }
    let ratio = (vv / dd).sqrt();
    (SAME_UNIT..=1.0 / SAME_UNIT).contains(&ratio)
}

/// A value of TOML that names the columns of a signal: a pattern where there is one, else a list.
pub(super) fn names(columns: &[Option<ColumnUse>], mapping: &ColumnMapping) -> String {
    let joints = &mapping.joints;
    let whole: Option<Vec<&str>> = columns.iter().map(|c| c.as_ref().map(|c| c.name.as_str())).collect();
    let pattern = whole.and_then(|names| by_joint(&names, joints).or_else(|| by_number(&names)));
    match pattern {
        Some(pattern) => super::toml_text::quoted(&pattern),
        None => {
            let list: Vec<String> = columns
                .iter()
                .map(|c| super::toml_text::quoted(c.as_ref().map_or("", |c| c.name.as_str())))
                .collect();
            format!("[{}]", list.join(", "))
        }
    }
}

/// `q_{joint}` of `q_shoulder`, `q_elbow`.
fn by_joint(names: &[&str], joints: &[String]) -> Option<String> {
    let (name, joint) = (names.first()?, joints.first()?);
    let at = name.find(joint.as_str())?;
    let pattern = format!("{}{{joint}}{}", &name[..at], &name[at + joint.len()..]);
    let fits = names.iter().zip(joints).all(|(name, joint)| pattern.replace("{joint}", joint) == **name);
    (fits && !name.contains(['{', '}'])).then_some(pattern)
}

/// `q{}` of `q1`, `q2`. With numbers from 0 a list says it more plainly than a pattern, whose start depends on other columns.
fn by_number(names: &[&str]) -> Option<String> {
    let name = names.first().filter(|n| !n.contains(['{', '}']))?;
    let at = name.find('1')?;
    let pattern = format!("{}{{}}{}", &name[..at], &name[at + 1..]);
    let fits =
        names.iter().enumerate().all(|(k, name)| pattern.replace("{}", &(k + 1).to_string()) == **name);
    (fits && names.len() > 1).then_some(pattern)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_that_share_a_pattern_are_named_by_it() {
        let joints = ["j1".to_owned(), "j2".to_owned()];
        assert_eq!(by_joint(&["/a/j1/q", "/a/j2/q"], &joints).as_deref(), Some("/a/{joint}/q"));
        assert_eq!(by_joint(&["/a/j2/q", "/a/j1/q"], &joints), None);
        assert_eq!(by_number(&["q1", "q2"]).as_deref(), Some("q{}"));
        assert_eq!(by_number(&["q0", "q1"]), None);
        assert_eq!(by_number(&["a1", "b2"]), None);
    }
}
