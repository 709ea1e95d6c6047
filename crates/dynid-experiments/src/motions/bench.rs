//! The robot as motions see it: coordinates, limits, start pose.

use dynid_config::joint_limits::{StatedLimits, joint_limits};
use dynid_identify::Error;
use dynid_identify::robot::Robot;
use dynid_identify::settings::known;
use dynid_model::MotionBlock;
use dynid_motion::trajectory::{MotionLimits, Sampled};

use super::config::{MotionConfig, MotionLimitsConfig};
use super::fault::MotionFault;

/// A robot with everything that parts ask for.
pub(super) struct Bench<'a> {
    pub(super) robot: &'a Robot,
    /// Coordinates: joints of a tree, independent joints of a mechanism with loops.
    pub(super) joints: Vec<String>,
    pub(super) limits: Vec<MotionLimits>,
    /// Position of every coordinate in the start pose.
    pub(super) start: Vec<f64>,
    /// Positions of all moving joints there, passive ones included.
    pub(super) all: Vec<(String, Vec<f64>)>,
    pub(super) rate_hz: f64,
}

impl<'a> Bench<'a> {
    pub(super) fn new(
        robot: &'a Robot,
        config: &MotionConfig,
        assumptions: &mut Vec<String>,
    ) -> Result<Self, Error> {
        let mechanism = &robot.mechanism;
        if robot.closed.is_none() && mechanism.positions() != mechanism.rates() {
            return Err(Error::Unsupported(
                "a floating base follows no joint trajectory: make motions for the arm alone".to_owned(),
            ));
        }
        let (names, owners) = (mechanism.rate_names(), mechanism.rate_bodies());
        let rates: Vec<usize> = match &robot.closed {
            Some(closed) => closed.independent().to_vec(),
            None => (0..mechanism.rates()).collect(),
        };
        if rates.is_empty() {
            return Err(Error::Unsupported("the robot has no joint that moves".to_owned()));
        }
        let joints: Vec<String> = rates.iter().map(|r| names[*r].clone()).collect();
        let bodies: Vec<usize> = rates.iter().map(|r| owners[*r]).collect();
        let MotionLimitsConfig { position, velocity, acceleration, jerk, share } = &config.limits;
        let stated = StatedLimits { position, velocity, acceleration, jerk, share: *share };
        let limits = joint_limits(robot, &bodies, &joints, &stated, assumptions)?;
        let start = start_pose(robot, config, &joints, &limits)?;
        let mut bench = Bench {
            robot,
            limits,
            all: joints.iter().cloned().zip(start.iter().map(|q| vec![*q])).collect(),
            joints,
            start,
            rate_hz: config.sample_rate_hz,
        };
        if let Some(closed) = &robot.closed {
            let mut pose = closed.workspace();
            closed.reach(&mut pose, &bench.start).map_err(|fault| MotionFault::Pose {
                part: "start pose".to_owned(),
                time_s: 0.0,
                fault: Box::new(fault),
            })?;
            let of_body = |body: &dynid_model::Body| {
                let q = &pose.positions()[body.position..][..body.joint.positions()];
                (body.joint.name.clone(), q.to_vec())
            };
            bench.all = mechanism.bodies().iter().map(of_body).collect();
        }
        Ok(bench)
    }

    /// Number of a coordinate.
    pub(super) fn coordinate(&self, joint: &String) -> Result<usize, Error> {
        known(joint, &self.joints)?;
        Ok(self.joints.iter().position(|j| j == joint).unwrap_or_default())
    }

    /// A duration made longer to whole samples, s.
    pub(super) fn on_grid(&self, duration_s: f64) -> f64 {
        (duration_s * self.rate_hz - 1e-6).ceil().max(1.0) / self.rate_hz
    }

    /// Refuses poses that loops cannot take, and ranges of passive joints that they break; `title`: of the part at a sample.
    pub(super) fn check_inside(
        &self,
        sampled: &Sampled,
        title: &dyn Fn(usize) -> String,
    ) -> Result<(), Error> {
        let Some(closed) = &self.robot.closed else { return Ok(()) };
        let ranges: Vec<(usize, &str, (f64, f64))> = (self.robot.mechanism.bodies().iter())
            .filter(|body| body.joint.positions() == 1 && !self.joints.contains(&body.joint.name))
            .filter_map(|body| {
                let range = body.joint.limits.position.filter(|(low, high)| low < high)?;
                Some((body.position, body.joint.name.as_str(), range))
            })
            .collect();
        let block = MotionBlock::plain(sampled.samples(), &sampled.q, &sampled.dq, &sampled.ddq);
        let mut pose = closed.workspace();
        let mut q = vec![0.0; self.joints.len()];
        for (sample, time_s) in sampled.time.iter().copied().enumerate() {
            for (k, x) in q.iter_mut().enumerate() {
                *x = block.q[k * block.stride + sample];
            }
            closed.reach(&mut pose, &q).map_err(|fault| MotionFault::Pose {
                part: title(sample),
                time_s,
                fault: Box::new(fault),
            })?;
            for (position, joint, (low, high)) in &ranges {
                let found = pose.positions()[*position];
                if !(found >= *low && found <= *high) {
                    let (part, joint) = (title(sample), (*joint).to_owned());
                    let fault = MotionFault::Inside { part, time_s, joint, low: *low, high: *high, found };
                    return Err(fault.into());
                }
            }
        }
        Ok(())
    }
}

fn start_pose(
    robot: &Robot,
    config: &MotionConfig,
    joints: &[String],
    limits: &[MotionLimits],
) -> Result<Vec<f64>, Error> {
    for joint in config.start.keys() {
        known(joint, joints)?;
    }
    let home = robot.closed.as_ref().map(|closed| closed.home_independent());
    let at = |(k, joint): (usize, &String)| {
        let (low, high) = limits[k].position;
        match (config.start.get(joint), &home) {
            (Some(x), _) if !(*x >= low && *x <= high) => {
                let expected = format!("{low} to {high}, the joint's limits");
                Err(Error::setting(&format!("start.{joint}"), &expected, x))
            }
            (Some(x), _) => Ok(*x),
            (None, Some(home)) if !(home[k] >= low && home[k] <= high) => {
                let expected = format!("{low} to {high}, the joint's limits, or a start pose beside it");
                Err(Error::setting(&format!("home.{joint}"), &expected, home[k]))
            }
            (None, Some(home)) => Ok(home[k]),
            (None, None) => Ok(0.0_f64.clamp(low, high)),
        }
    };
    joints.iter().enumerate().map(at).collect()
}
