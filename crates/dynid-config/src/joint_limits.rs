//! Limits of joints: those of the robot file, and what a configuration states in their place.

use std::collections::BTreeMap;

use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_identify::settings::known;
use dynid_motion::trajectory::MotionLimits;

use crate::config::PerJoint;

/// Time to full speed where no acceleration limit is given, s.
const TIME_TO_SPEED: f64 = 0.5;

/// What a configuration states.
pub struct StatedLimits<'a> {
    /// Lowest and highest position by joint, rad or m.
    pub position: &'a BTreeMap<String, [f64; 2]>,
    /// Speed, rad/s or m/s.
    pub velocity: &'a PerJoint,
    /// Acceleration, rad/s² or m/s².
    pub acceleration: &'a PerJoint,
    /// Jerk, rad/s³ or m/s³.
    pub jerk: &'a PerJoint,
    /// Share of the robot file's limits that may be used.
    pub share: f64,
}

/// Limits of joints. Positions of joints that turn without a stated range are half a turn to both sides; accelerations that are not
/// stated are full speed in half a second; both are told in `assumptions`.
///
/// `bodies`: the body that each of `joints` moves.
///
/// # Errors
/// [`Error::UnknownJoint`], [`Error::Setting`] for a range or a speed that nobody states, and numbers out of range.
pub fn joint_limits(
    robot: &Robot,
    bodies: &[usize],
    joints: &[String],
    l: &StatedLimits<'_>,
    assumptions: &mut Vec<String>,
) -> Result<Vec<MotionLimits>, Error> {
    for joint in l.position.keys() {
        known(joint, joints)?;
    }
    let velocity = l.velocity.positive("limits.velocity", joints)?;
    let acceleration = l.acceleration.positive("limits.acceleration", joints)?;
    let jerk = l.jerk.positive("limits.jerk", joints)?;
    let mut unlimited = Vec::new();
    let mut assumed = Vec::new();
    let mut out = Vec::with_capacity(joints.len());
    for (k, joint) in joints.iter().enumerate() {
        let described = &robot.mechanism.bodies()[bodies[k]].joint;
        let slides = described.effort_unit() == "N";
        let stated = described.limits.position.filter(|(a, b)| a < b && a.is_finite() && b.is_finite());
        let position = match (l.position.get(joint), stated) {
            (Some([low, high]), _) => (*low, *high),
            (None, Some((low, high))) => {
                let cut = 0.5 * (1.0 - l.share) * (high - low);
                (low + cut, high - cut)
            }
            (None, None) if !slides => {
                unlimited.push(joint.as_str());
                (-std::f64::consts::PI, std::f64::consts::PI)
            }
            (None, None) => {
                let expected = "a range, m: the robot file states none";
                return Err(Error::setting(&format!("limits.position.{joint}"), expected, "none"));
            }
        };
        if !(position.0 < position.1 && position.0.is_finite() && position.1.is_finite()) {
            let found = format!("{} to {}", position.0, position.1);
            return Err(Error::setting(
                &format!("limits.position.{joint}"),
                "least below largest, finite",
                found,
            ));
        }
        let stated = described.limits.velocity.filter(|v| *v > 0.0 && v.is_finite()).map(|v| l.share * v);
        let Some(speed) = velocity[k].or(stated) else {
            let expected = "a speed: the robot file states none";
            return Err(Error::setting(&format!("limits.velocity.{joint}"), expected, "none"));
        };
        if acceleration[k].is_none() {
            assumed.push(joint.as_str());
        }
        out.push(MotionLimits {
            position,
            velocity: speed,
            acceleration: acceleration[k].unwrap_or(speed / TIME_TO_SPEED),
            jerk: jerk[k].unwrap_or(f64::INFINITY),
        });
    }
    if !unlimited.is_empty() {
        assumptions.push(format!(
            "no position limits are stated for {}: half a turn to both sides is used",
            unlimited.join(", ")
        ));
    }
    if !assumed.is_empty() {
        assumptions.push(format!(
            "no acceleration limits are stated for {}: full speed in {TIME_TO_SPEED} s is used",
            assumed.join(", ")
        ));
    }
    Ok(out)
}
