//! Formats of logs that are known by their columns.

use std::fmt;

use super::Missing;
use crate::signal::Signal;

/// A tool whose logs are recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogFormat {
    /// The CSV export of PlotJuggler: `__time`, then one column per series, cells empty where a series has no sample.
    PlotJuggler,
    /// `rostopic echo -p` (ROS 1) of joint states: `%time`, `field.header.stamp`, `field.name0`, `field.position0`, ...
    RostopicEcho,
    /// `ros2 topic echo --csv` of joint states: no header; names of joints, then their values.
    Ros2TopicEcho,
    /// A recording of the real-time data exchange of Universal Robots: `timestamp actual_q_0 ...`.
    Rtde,
    /// A bag of ROS: topics with stamps of their own.
    Bag,
    /// A dataset of LeRobot: `observation.state`, `action`, `timestamp`, `episode_index`.
    LeRobot,
    /// A log of libfranka: `time,success_rate,state.q[0],...`, or `duration, success rate, q[0], ...` of older versions.
    Libfranka,
}

impl fmt::Display for LogFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            LogFormat::PlotJuggler => "PlotJuggler CSV export",
            LogFormat::RostopicEcho => "rostopic echo -p (ROS 1)",
            LogFormat::Ros2TopicEcho => "ros2 topic echo --csv",
            LogFormat::Rtde => "UR RTDE recording",
            LogFormat::Bag => "ROS bag",
            LogFormat::LeRobot => "LeRobot dataset",
            LogFormat::Libfranka => "libfranka log",
        })
    }
}

impl LogFormat {
    /// The format that a header belongs to.
    pub(super) fn of_names(names: &[String]) -> Option<LogFormat> {
        let has = |name: &str| names.iter().any(|n| n == name);
        match names.first().map(String::as_str) {
            Some("__time") => return Some(LogFormat::PlotJuggler),
            Some("%time") => return Some(LogFormat::RostopicEcho),
            _ => {}
        }
        if has("actual_q_0") || has("target_q_0") {
            return Some(LogFormat::Rtde);
        }
        if has("episode_index") && names.iter().any(|n| n.starts_with("observation.state")) {
            return Some(LogFormat::LeRobot);
        }
        let success = has("success_rate") || has("success rate");
        if success && (has("state.q[0]") || has("tau_J[0]")) {
            return Some(LogFormat::Libfranka);
        }
        None
    }

    /// By what a format is recognised.
    pub(super) fn mark(self) -> &'static str {
        match self {
            LogFormat::PlotJuggler => "its first column is `__time`",
            LogFormat::RostopicEcho => "its first column is `%time`",
            LogFormat::Ros2TopicEcho => {
                "no header; seconds, nanoseconds, a frame, names of joints, then numbers"
            }
            LogFormat::Rtde => "it has columns such as `actual_q_0`",
            LogFormat::Bag => "it has topics",
            LogFormat::LeRobot => "it has `observation.state` beside `episode_index`",
            LogFormat::Libfranka => "it has a success rate beside `q[0]` and `tau_J[0]`",
        }
    }

    /// What becomes of rows without a value unless it is stated: in some formats cells are empty by design, since series have
    /// stamps of their own.
    pub fn missing(self) -> Missing {
        match self {
            LogFormat::PlotJuggler | LogFormat::Ros2TopicEcho => Missing::Drop,
            LogFormat::Bag => Missing::Interpolate,
            _ => Missing::Error,
        }
    }

    /// Names that the format has for a signal, most trusted first; `{}` is the number of the joint from 0, `{joint}` its name.
    pub(crate) fn patterns(self, signal: Signal) -> &'static [&'static str] {
        match (self, signal) {
            (LogFormat::Rtde, Signal::Position) => &["actual_q_{}"],
            (LogFormat::Rtde, Signal::Velocity) => &["actual_qd_{}"],
            (LogFormat::Rtde, Signal::Temperature) => &["joint_temperatures_{}"],
            (LogFormat::LeRobot, Signal::Position) => {
                &["observation.state/{joint}.pos", "observation.state/{joint}", "observation.state[{}]"]
            }
            (LogFormat::LeRobot, Signal::Velocity) => &[
                "observation.velocity/{joint}.vel",
                "observation.velocity/{joint}",
                "observation.velocity[{}]",
                "observation.state/{joint}.vel",
            ],
            (LogFormat::LeRobot, Signal::Effort) => &[
                "observation.effort/{joint}.effort",
                "observation.effort/{joint}",
                "observation.effort[{}]",
                "observation.state/{joint}.torque",
            ],
            (LogFormat::Libfranka, Signal::Position) => &["state.q[{}]", "q[{}]"],
            (LogFormat::Libfranka, Signal::Velocity) => &["state.dq[{}]", "dq[{}]"],
            (LogFormat::Libfranka, Signal::Effort) => &["state.tau_J[{}]", "tau_J[{}]"],
            _ => &[],
        }
    }

    /// Names of measured motor currents, which drive gains turn into efforts; `{}` as in [`LogFormat::patterns`].
    pub(crate) fn currents(self) -> Option<&'static str> {
        (self == LogFormat::Rtde).then_some("actual_current_{}")
    }

    /// Names of its time columns, most trusted first.
    pub(super) fn time_names(self) -> &'static [&'static str] {
        match self {
            LogFormat::PlotJuggler => &["__time"],
            LogFormat::RostopicEcho => &["field.header.stamp", "%time"],
            LogFormat::LeRobot => &["timestamp"],
            LogFormat::Bag | LogFormat::Ros2TopicEcho | LogFormat::Rtde => &[],
            LogFormat::Libfranka => &["time", "duration"],
        }
    }
}
