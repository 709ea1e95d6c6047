//! The motion to draw.

use serde::Serialize;

/// An actuated joint and its limits; a limit that is `None` is neither drawn nor stated.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DesignJoint {
    /// Name given by the robot file.
    pub name: String,
    /// Unit of its position, `rad` or `m`.
    pub unit: String,
    /// Unit of its effort, `N m` or `N`.
    pub effort_unit: String,
    /// Lowest position, in `unit`.
    pub position_low: Option<f64>,
    /// Highest position, in `unit`.
    pub position_high: Option<f64>,
    /// Largest speed, `unit`/s; holds in both directions, as the following limits do.
    pub velocity: Option<f64>,
    /// Largest acceleration, `unit`/s².
    pub acceleration: Option<f64>,
    /// Largest jerk, `unit`/s³.
    pub jerk: Option<f64>,
    /// Largest effort, in `effort_unit`.
    pub effort: Option<f64>,
}

/// The motion from the parking pose through the recorded periods and back.
///
/// Give every sample; the report decimates for drawing. A sample that is not finite leaves a gap, and the number of such
/// samples is stated beside the plot.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Trajectory {
    /// Time of each sample, s; finite and not decreasing.
    pub time_s: Vec<f64>,
    /// Start and end of the recorded part, s; before lies the approach, behind it the return. `None`: all is recorded.
    pub recorded_s: Option<[f64; 2]>,
    /// Per joint.
    pub joints: Vec<JointMotion>,
    /// Paths of frames, drawn in the order given.
    pub frames: Vec<FramePath>,
}

/// Motion of one joint, one entry per entry of [`Trajectory::time_s`].
#[derive(Clone, Debug, Default, Serialize)]
pub struct JointMotion {
    /// Position, in the joint's unit.
    pub q: Vec<f64>,
    /// Velocity, unit/s.
    pub dq: Vec<f64>,
    /// Acceleration, unit/s².
    pub ddq: Vec<f64>,
    /// Jerk, unit/s³; `None` leaves its plot out.
    pub jerk: Option<Vec<f64>>,
    /// Effort by the nominal model, in the joint's effort unit; `None` leaves its plot out.
    pub effort: Option<Vec<f64>>,
}

/// Path of one frame, e.g. of the end effector.
#[derive(Clone, Debug, Default, Serialize)]
pub struct FramePath {
    /// Name of the frame.
    pub name: String,
    /// Position in base axes (`z` upwards), m, one entry per entry of [`Trajectory::time_s`].
    pub xyz_m: Vec<[f64; 3]>,
}
