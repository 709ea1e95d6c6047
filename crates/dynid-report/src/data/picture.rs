//! The robot as lines along its kinematic chain, in the poses of a motion.

use serde::Serialize;

/// The robot in the poses of a motion: points that every pose places, and lines between them.
///
/// A line or a pose that names a point which is not there, or lacks one, is a [`crate::ReportError::Length`].
#[derive(Clone, Debug, Default, Serialize)]
pub struct RobotPicture {
    /// What the poses are, for the caption, e.g. `poses of train.csv`.
    pub caption: String,
    /// What each point is, in the order of [`Pose::points_m`].
    pub points: Vec<PointKind>,
    /// Lines between points.
    pub lines: Vec<PictureLine>,
    /// Direction in base axes that is drawn upwards, such as that against gravity; zero draws `z` upwards.
    pub up: [f64; 3],
    /// The poses in order of time; with one there is no motion to play.
    pub poses: Vec<Pose>,
    /// Index of the pose that is drawn before the motion is played, and on paper.
    pub shown: usize,
    /// Index of the point whose path is drawn; `None` draws none.
    pub trail: Option<usize>,
    /// The motion begins to play by itself, unless the reader's system asks for little motion.
    pub plays: bool,
}

/// What a point of a [`RobotPicture`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PointKind {
    /// An end of a line and nothing else; not marked.
    #[default]
    End,
    /// Origin of the base.
    Base,
    /// Origin of a joint that turns.
    Turns,
    /// Origin of a joint that slides.
    Slides,
    /// Centre of mass of a link.
    Mass,
}

/// A line of a [`RobotPicture`].
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct PictureLine {
    /// Indices of both ends in [`RobotPicture::points`].
    pub ends: [usize; 2],
    /// What the line is.
    pub kind: LineKind,
}

/// What a line of a [`RobotPicture`] is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LineKind {
    /// A link, from joint to joint.
    #[default]
    Link,
    /// The axis of a joint.
    Axis,
    /// From the last joint of a branch to the centre of mass of its link.
    Mass,
}

/// One pose.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Pose {
    /// Time, s.
    pub time_s: f64,
    /// Places of the points in base axes, m.
    pub points_m: Vec<[f64; 3]>,
}
