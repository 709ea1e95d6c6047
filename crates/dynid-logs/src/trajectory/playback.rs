//! Trajectories for what plays them: MoveIt, the scripts of Universal Robots, real-time interfaces, MuJoCo.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use dynid_files::output::OutputError;
use dynid_motion::trajectory::Sampled;
use quick_xml::escape::escape;

use super::csv::check_shape;
use super::ros::JointTrajectory;
use crate::csv;

/// What plays a trajectory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Playback {
    /// `moveit_msgs/msg/RobotTrajectory` as YAML.
    MoveIt,
    /// URScript: a `servoj` per sample.
    UrScript,
    /// Positions at 1 kHz for the control interface of Franka Robotics (libfranka), CSV.
    Fci,
    /// Positions at 1 kHz for KUKA's Fast Robot Interface, CSV.
    Fri,
    /// `<keyframe>` of MJCF.
    MuJoCo,
}

/// Rate of the real-time interfaces, Hz.
const REAL_TIME_HZ: f64 = 1000.0;
/// Rate of the controllers of Universal Robots, Hz: the time of a `servoj` is a multiple of its step.
const UR_HZ: f64 = 500.0;
/// Joints of Universal Robots, and of the arms with real-time interfaces.
const UR_JOINTS: usize = 6;
const REAL_TIME_JOINTS: usize = 7;
/// What a controller takes for rest, rad/s.
const AT_REST: f64 = 1e-3;
/// Most samples in one file.
const MAX_SAMPLES: usize = 1_000_000;
/// Largest accelerations and jerks that libfranka lets through, rad/s² and rad/s³: the larger of Panda and Franka Research 3, joint by joint.
const FRANKA_ACCELERATION: [f64; REAL_TIME_JOINTS] = [15.0, 10.0, 10.0, 12.5, 15.0, 20.0, 20.0];
const FRANKA_JERK: [f64; REAL_TIME_JOINTS] = [7500.0, 5000.0, 5000.0, 6250.0, 7500.0, 10000.0, 10000.0];

impl Playback {
    /// What the name of its file ends in, behind a point.
    pub fn ending(self) -> &'static str {
        match self {
            Playback::MoveIt => "moveit.yaml",
            Playback::UrScript => "ur.script",
            Playback::Fci => "fci.csv",
            Playback::Fri => "fri.csv",
            Playback::MuJoCo => "mujoco.xml",
        }
    }

    /// Rate of its samples, Hz, for a motion with a rate of its own.
    pub fn rate_hz(self, own: f64) -> f64 {
        match self {
            Playback::Fci | Playback::Fri => REAL_TIME_HZ,
            _ => own,
        }
    }

    /// The text of a file. `sampled`: at the rate of [`Playback::rate_hz`], rad or m; `joints`: a name per coordinate, in the order of the robot;
    /// `file` stands in errors.
    ///
    /// - MoveIt: all of the motion, without joints of several degrees of freedom.
    /// - URScript: `movej` to the first sample, then `servoj(q, 0, 0, t, 0.1, 300)` with the step `t`, then `stopj`.
    /// - FCI and FRI: `t`, `q_<joint>` of every joint.
    /// - MuJoCo: a key per sample with `time`, `qpos`, `qvel`, for a model whose joints are these in this order.
    ///
    /// # Errors
    /// [`OutputError::Shape`], [`OutputError::NotFinite`]; [`OutputError::Refused`] with what the robots cannot do: another number of joints, a rate
    /// that is no part of theirs, a motion that begins or ends at speed, positions beyond a turn (UR), accelerations or jerks beyond those of
    /// libfranka (FCI), none or more than 1e6 samples.
    pub fn text(self, file: &Path, joints: &[String], sampled: &Sampled) -> Result<String, OutputError> {
        check_shape(file, "joint names", sampled.coordinates(), joints.len())?;
        let motion = Motion { file, joints, sampled };
        motion.check_finite()?;
        if !(1..=MAX_SAMPLES).contains(&sampled.samples()) {
            let expected = format!("1 to {MAX_SAMPLES}");
            return Err(motion.refuse("samples", expected, sampled.samples().to_string()));
        }
        match self {
            Playback::MoveIt => motion.moveit(),
            Playback::UrScript => motion.ur_script(),
            Playback::Fci => {
                motion.check_joints(REAL_TIME_JOINTS)?;
                motion.check_rest()?;
                motion.check_franka()?;
                motion.positions()
            }
            Playback::Fri => {
                motion.check_joints(REAL_TIME_JOINTS)?;
                motion.check_rest()?;
                motion.positions()
            }
            Playback::MuJoCo => Ok(motion.keyframes()),
        }
    }
}

/// A motion on its way to a file.
struct Motion<'a> {
    file: &'a Path,
    joints: &'a [String],
    sampled: &'a Sampled,
}

impl Motion<'_> {
    fn refuse(&self, subject: &str, expected: impl Into<String>, found: impl Into<String>) -> OutputError {
        OutputError::Refused {
            file: self.file.display().to_string(),
            subject: subject.to_owned(),
            expected: expected.into(),
            found: found.into(),
        }
    }

    /// Values of a signal at a sample.
    fn at(&self, signal: &[f64], sample: usize) -> Vec<f64> {
        (0..self.joints.len()).map(|c| signal[c * self.sampled.samples() + sample]).collect()
    }

    fn check_finite(&self) -> Result<(), OutputError> {
        let n = self.sampled.samples();
        for signal in [&self.sampled.q, &self.sampled.dq, &self.sampled.ddq] {
            if let Some(k) = signal.iter().position(|x| !x.is_finite()) {
                return Err(OutputError::NotFinite {
                    file: self.file.display().to_string(),
                    row: k % n + 1,
                    column: self.joints[k / n].clone(),
                    found: signal[k],
                });
            }
        }
        Ok(())
    }

    fn check_joints(&self, expected: usize) -> Result<(), OutputError> {
        match self.joints.len() {
            n if n == expected => Ok(()),
            n => Err(self.refuse("joints", format!("{expected}, as the robot has"), n.to_string())),
        }
    }

    /// A robot that stands still cannot be at speed with the next sample.
    fn check_rest(&self) -> Result<(), OutputError> {
        let n = self.sampled.samples();
        for (sample, place) in [(0, "first sample"), (n.saturating_sub(1), "last sample")] {
            let speeds = self.at(&self.sampled.dq, sample);
            if let Some((joint, speed)) = self.joints.iter().zip(&speeds).find(|(_, v)| v.abs() > AT_REST) {
                let found = format!("{speed:.4} rad/s of `{joint}`");
                return Err(self.refuse(place, "a robot at rest", found));
            }
        }
        Ok(())
    }

    /// Accelerations, and jerks from sample to sample, within what libfranka takes.
    fn check_franka(&self) -> Result<(), OutputError> {
        let n = self.sampled.samples();
        for (c, joint) in self.joints.iter().enumerate() {
            let acceleration = &self.sampled.ddq[c * n..(c + 1) * n];
            let jerk = acceleration.windows(2).map(|pair| (pair[1] - pair[0]) * REAL_TIME_HZ);
            let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0_f64, |m, x| m.max(x.abs()));
            for (what, unit, found, limit) in [
                (
                    "acceleration",
                    "rad/s²",
                    largest(&mut acceleration.iter().copied()),
                    FRANKA_ACCELERATION[c],
                ),
                ("jerk", "rad/s³", largest(&mut { jerk }), FRANKA_JERK[c]),
            ] {
                if found > limit {
                    let expected = format!("at most {limit} {unit}, which libfranka takes");
                    return Err(self.refuse(
                        &format!("{what} of `{joint}`"),
                        expected,
                        format!("{found:.1}"),
                    ));
                }
            }
        }
        Ok(())
    }

    fn moveit(&self) -> Result<String, OutputError> {
        let message = JointTrajectory::new(self.joints, self.sampled, self.file)?.to_yaml();
        let mut out = String::from("joint_trajectory:\n");
        for line in message.lines() {
            // Writing to a String does not fail.
            let _ = writeln!(out, "  {line}");
        }
        out.push_str(
            "multi_dof_joint_trajectory:\n  header:\n    stamp: {sec: 0, nanosec: 0}\n    frame_id: ''\n",
        );
        out.push_str("  joint_names: []\n  points: []\n");
        Ok(out)
    }

    fn ur_script(&self) -> Result<String, OutputError> {
        self.check_joints(UR_JOINTS)?;
        self.check_rest()?;
        let n = self.sampled.samples();
        let step = match self.sampled.time.as_slice() {
            [first, second, ..] => second - first,
            _ => return Err(self.refuse("samples", "two or more", n.to_string())),
        };
        let steps = step * UR_HZ;
        if (steps - steps.round()).abs() > 1e-6 || steps.round() < 1.0 {
            let expected = format!("{UR_HZ} Hz or a whole part of it, such as 250 or 125");
            return Err(self.refuse("rate", expected, format!("{:.6}", 1.0 / step)));
        }
        let step = steps.round() / UR_HZ;
        if let Some(k) = self.sampled.q.iter().position(|q| q.abs() > TAU) {
            let subject = format!("position of `{}`", self.joints[k / n]);
            return Err(self.refuse(
                &subject,
                "at most one turn, 6.2832 rad",
                format!("{:.4}", self.sampled.q[k]),
            ));
        }
        let list = |sample: usize| {
            let numbers: Vec<String> =
                self.at(&self.sampled.q, sample).iter().map(|q| format!("{q:.9}")).collect();
            format!("[{}]", numbers.join(", "))
        };
        let names: Vec<String> = self.joints.iter().map(|name| name.replace(char::is_control, " ")).collect();
        let mut out = format!(
            "# {n} samples at {} Hz, joints in this order: {}\n# Controllers of the CB series take steps that are multiples of 0.008 s.\ndef dynid_motion():\n",
            1.0 / step,
            names.join(", ")
        );
        let _ = writeln!(out, "  movej({}, a=0.5, v=0.3)", list(0));
        for sample in 0..n {
            let _ = writeln!(out, "  servoj({}, 0, 0, {step}, 0.1, 300)", list(sample));
        }
        out.push_str("  stopj(2.0)\nend\n");
        Ok(out)
    }

    fn positions(&self) -> Result<String, OutputError> {
        let n = self.sampled.samples();
        let header: Vec<String> =
            std::iter::once("t".to_owned()).chain(self.joints.iter().map(|j| format!("q_{j}"))).collect();
        let time: Vec<f64> = (0..n).map(|sample| sample as f64 / REAL_TIME_HZ).collect();
        let columns: Vec<&[f64]> = std::iter::once(time.as_slice()).chain(self.sampled.q.chunks(n)).collect();
        csv::text(&self.file.display().to_string(), &header, &columns)
    }

    fn keyframes(&self) -> String {
        let names: Vec<String> = self.joints.iter().map(|name| name.replace("--", "- -")).collect();
        let mut out =
            format!("<mujoco>\n  <!-- qpos and qvel: {} -->\n  <keyframe>\n", escape(names.join(" ")));
        let list = |signal: &[f64], sample: usize| {
            self.at(signal, sample).iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
        };
        for (sample, time) in self.sampled.time.iter().enumerate() {
            let (q, dq) = (list(&self.sampled.q, sample), list(&self.sampled.dq, sample));
            let _ = writeln!(
                out,
                "    <key name=\"motion{sample}\" time=\"{time}\" qpos=\"{q}\" qvel=\"{dq}\"/>"
            );
        }
        out.push_str("  </keyframe>\n</mujoco>\n");
        out
    }
}
