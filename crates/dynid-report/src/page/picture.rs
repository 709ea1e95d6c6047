//! The robot's picture as templates and the script see it.

use serde::Serialize;

use super::script_data::script_json;
use crate::data::{LineKind, PointKind, RobotPicture};
use crate::drawing::{RobotView, robot_mark, robot_svg};
use crate::error::ReportError;
use crate::number::significant;

/// The picture in its pose, and the motion for the script.
#[derive(Debug, Serialize)]
pub(super) struct PictureView<'a> {
    caption: &'a str,
    svg: String,
    /// Time of the pose, s.
    time: String,
    /// JSON for the script; absent if there is one pose.
    motion: Option<String>,
    poses: usize,
    shown: usize,
    plays: bool,
    axes: bool,
    masses: bool,
}

/// Poses in whole numbers of a small length, with what the script needs to draw them as the still picture is drawn.
#[derive(Debug, Serialize)]
struct Motion<'a> {
    right: [f64; 3],
    above: [f64; 3],
    up: [f64; 3],
    at: [f64; 2],
    /// Length that coordinates count, m.
    unit: f64,
    times: Vec<f64>,
    poses: Vec<Vec<i64>>,
    lines: Vec<(&'a str, [usize; 2])>,
    /// Points that are marked, in the order of the marks.
    marks: Vec<usize>,
}

/// `None` if nothing can be drawn.
pub(super) fn picture(data: &RobotPicture) -> Result<Option<PictureView<'_>>, ReportError> {
    let svg = robot_svg(data, "The robot as lines from joint to joint");
    if svg.is_empty() {
        return Ok(None);
    }
    let has = |kind: LineKind| data.lines.iter().any(|line| line.kind == kind);
    let motion = if data.poses.len() > 1 { motion(data)? } else { None };
    Ok(Some(PictureView {
        caption: &data.caption,
        svg,
        time: data.poses.get(data.shown).map_or_else(String::new, |p| significant(p.time_s, 3)),
        motion,
        poses: data.poses.len(),
        shown: data.shown,
        plays: data.plays,
        axes: has(LineKind::Axis),
        masses: has(LineKind::Mass),
    }))
}

fn motion(data: &RobotPicture) -> Result<Option<String>, ReportError> {
    let Some(view) = RobotView::of(data) else { return Ok(None) };
    let largest =
        data.poses.iter().flat_map(|p| p.points_m.iter().flatten()).copied().filter(|x| x.is_finite());
    let largest = largest.fold(0.0, |most: f64, x| most.max(x.abs()));
    // Half a pixel at full size is more than this.
    let unit = largest / 2000.0;
    let whole = |x: f64| if x.is_finite() { (x / unit).round() as i64 } else { 0 };
    let class = |kind: LineKind| match kind {
        LineKind::Link => "link",
        LineKind::Axis => "axis",
        LineKind::Mass => "mass",
    };
    let rounded = |x: f64, to: f64| (x * to).round() / to;
    let motion = Motion {
        right: view.right.map(|x| rounded(x, 1e4)),
        above: view.above.map(|x| rounded(x, 1e4)),
        up: view.up.map(|x| rounded(x, 1e6)),
        at: view.at.map(|x| rounded(x, 1e2)),
        unit,
        times: data.poses.iter().map(|p| rounded(p.time_s, 1e3)).collect(),
        poses: data.poses.iter().map(|p| p.points_m.iter().flatten().map(|x| whole(*x)).collect()).collect(),
        lines: data.lines.iter().map(|line| (class(line.kind), line.ends)).collect(),
        marks: marks(&data.points),
    };
    Ok(Some(script_json(&motion)?))
}

fn marks(points: &[PointKind]) -> Vec<usize> {
    (0..points.len()).filter(|k| robot_mark(points[*k]).is_some()).collect()
}

/// Fails unless every pose places every point, and lines, path and shown pose are among them.
pub(super) fn check(data: &RobotPicture) -> Result<(), ReportError> {
    let points = data.points.len();
    for (k, pose) in data.poses.iter().enumerate() {
        super::lengths::length(&format!("picture of the robot, pose {k}"), pose.points_m.len(), points)?;
    }
    let named = data.lines.iter().flat_map(|line| line.ends).chain(data.trail).max();
    let among = |place: &str, index: usize, count: usize| {
        if index < count {
            return Ok(());
        }
        Err(ReportError::Length { place: place.to_owned(), found: count, expected: index + 1 })
    };
    if let Some(named) = named {
        among("picture of the robot, points", named, points)?;
    }
    if data.poses.is_empty() {
        Ok(())
    } else {
        among("picture of the robot, poses", data.shown, data.poses.len())
    }
}
