//! ROS 2 messages `trajectory_msgs/msg/JointTrajectory` as YAML and JSON.

use std::fmt::Write;
use std::path::Path;

use dynid_files::output::{OutputError, write_atomically};
use dynid_motion::trajectory::Sampled;
use serde::Serialize;

use super::csv::check_shape;

/// `trajectory_msgs/msg/JointTrajectory`; `serde` and [`Self::to_yaml`] give the form of `ros2 topic pub` and `echo`.
#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
pub struct JointTrajectory {
    header: Header,
    joint_names: Vec<String>,
    points: Vec<JointTrajectoryPoint>,
}

#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
struct Header {
    stamp: Time,
    frame_id: String,
}

/// `builtin_interfaces/msg/Time` and `Duration`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, schemars::JsonSchema)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Debug, Clone, PartialEq, Serialize, schemars::JsonSchema)]
struct JointTrajectoryPoint {
    positions: Vec<f64>,
    velocities: Vec<f64>,
    accelerations: Vec<f64>,
    effort: Vec<f64>,
    time_from_start: Time,
}

impl Time {
    /// Rounded to nanoseconds; `None` if it is negative or beyond 2^31 s.
    fn of(seconds: f64) -> Option<Time> {
        let whole = seconds.floor();
        let nanosec = ((seconds - whole) * 1e9).round() as u32;
        let (whole, nanosec) = if nanosec == 1_000_000_000 { (whole + 1.0, 0) } else { (whole, nanosec) };
        (0.0..f64::from(i32::MAX)).contains(&whole).then_some(Time { sec: whole as i32, nanosec })
    }
}

impl JointTrajectory {
    /// The message for a sampled trajectory: stamp 0 (start at once), no frame, no efforts; `time_from_start` counts from the
    /// first sample. `file` names the output in errors.
    ///
    /// # Errors
    /// [`OutputError::Shape`] if there is not one name per coordinate, [`OutputError::NotFinite`] for a number that is not
    /// finite or a time that the message cannot hold.
    pub fn new(joints: &[String], sampled: &Sampled, file: &Path) -> Result<Self, OutputError> {
        check_shape(file, "joint names", sampled.coordinates(), joints.len())?;
        let n = sampled.samples();
        let fault = |s: usize, column: &str, found: f64| OutputError::NotFinite {
            file: file.display().to_string(),
            row: s + 1,
            column: column.to_owned(),
            found,
        };
        let at = |signal: &[f64], s: usize| -> Result<Vec<f64>, OutputError> {
            (0..joints.len())
                .map(|c| Some(signal[c * n + s]).filter(|x| x.is_finite()).ok_or((c, signal[c * n + s])))
                .collect::<Result<_, _>>()
                .map_err(|(c, found)| fault(s, &joints[c], found))
        };
        let points = (0..n).map(|s| {
            let time = sampled.time[s] - sampled.time[0];
            Ok(JointTrajectoryPoint {
                positions: at(&sampled.q, s)?,
                velocities: at(&sampled.dq, s)?,
                accelerations: at(&sampled.ddq, s)?,
                effort: Vec::new(),
                time_from_start: Time::of(time).ok_or_else(|| fault(s, "time_from_start", time))?,
            })
        });
        Ok(JointTrajectory {
            header: Header { stamp: Time { sec: 0, nanosec: 0 }, frame_id: String::new() },
            joint_names: joints.to_vec(),
            points: points.collect::<Result<_, OutputError>>()?,
        })
    }

    /// YAML that YAML 1.1 and 1.2 readers take alike; numbers read back to the same `f64`.
    pub fn to_yaml(&self) -> String {
        let mut out = String::new();
        let time = |t: &Time| format!("{{sec: {}, nanosec: {}}}", t.sec, t.nanosec);
        let names: Vec<String> = self.joint_names.iter().map(|n| quoted(n)).collect();
        // Writing to a String does not fail.
        let _ = writeln!(out, "header:\n  stamp: {}\n  frame_id: ''", time(&self.header.stamp));
        let _ = writeln!(out, "joint_names: [{}]", names.join(", "));
        let _ = writeln!(out, "points:{}", if self.points.is_empty() { " []" } else { "" });
        for point in &self.points {
            for (key, values) in [
                ("- positions", &point.positions),
                ("  velocities", &point.velocities),
                ("  accelerations", &point.accelerations),
                ("  effort", &point.effort),
            ] {
                let values: Vec<String> = values.iter().map(|x| yaml_float(*x)).collect();
                let _ = writeln!(out, "{key}: [{}]", values.join(", "));
            }
            let _ = writeln!(out, "  time_from_start: {}", time(&point.time_from_start));
        }
        out
    }

    /// JSON of the same structure.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string(self)
            .unwrap_or_else(|e| unreachable!("a message holds only plain data: {e}"));
        text.push('\n');
        text
    }
}

/// Writes the message as YAML, whole or not at all.
///
/// # Errors
/// Fails as [`JointTrajectory::new`] does, and [`OutputError::Unwritable`].
pub fn write_ros_yaml(
    path: impl AsRef<Path>,
    joints: &[String],
    sampled: &Sampled,
) -> Result<(), OutputError> {
    let message = JointTrajectory::new(joints, sampled, path.as_ref())?;
    write_atomically(path, message.to_yaml().as_bytes())
}

/// Writes the message as JSON, whole or not at all.
///
/// # Errors
/// Fails as [`write_ros_yaml`] does.
pub fn write_ros_json(
    path: impl AsRef<Path>,
    joints: &[String],
    sampled: &Sampled,
) -> Result<(), OutputError> {
    let message = JointTrajectory::new(joints, sampled, path.as_ref())?;
    write_atomically(path, message.to_json().as_bytes())
}

/// A double-quoted YAML scalar: JSON's escapes are a part of YAML's.
fn quoted(name: &str) -> String {
    serde_json::to_string(name).unwrap_or_else(|e| unreachable!("a string is plain data: {e}"))
}

/// The shortest form that reads back to the same number. YAML 1.1 takes `1e-7` for text: it wants a point in the mantissa and
/// a sign in the exponent.
fn yaml_float(x: f64) -> String {
    let text = format!("{x:?}");
    let Some((mantissa, exponent)) = text.split_once('e') else { return text };
    let point = if mantissa.contains('.') { "" } else { ".0" };
    let sign = if exponent.starts_with('-') { "" } else { "+" };
    format!("{mantissa}{point}e{sign}{exponent}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_round_to_nanoseconds_and_carry() {
        let time = |s: f64| Time::of(s).map(|t| (t.sec, t.nanosec));
        assert_eq!(time(0.0), Some((0, 0)));
        assert_eq!(time(1.25), Some((1, 250_000_000)));
        assert_eq!(time(2.999_999_999_9), Some((3, 0)));
        assert_eq!(time(-1.0), None);
        assert_eq!(time(1e10), None);
    }

    #[test]
    fn yaml_numbers_have_points_and_signed_exponents() {
        let forms = [
            (0.0, "0.0"),
            (1.0, "1.0"),
            (-0.25, "-0.25"),
            (1e-7, "1.0e-7"),
            (-1.5e-7, "-1.5e-7"),
            (1e22, "1.0e+22"),
            (1.25e300, "1.25e+300"),
        ];
        for (x, text) in forms {
            assert_eq!(yaml_float(x), text);
            assert_eq!(text.parse::<f64>().unwrap(), x);
        }
    }
}
