//! Paths of frames among obstacles.

use serde::Serialize;

use crate::data::{DesignReport, FramePath, Obstacle, Shape, Trajectory};
use crate::drawing::{PathParts, View, view_pictures};
use crate::number::shortest;

#[derive(Debug, Serialize)]
pub(super) struct PathView<'a> {
    frame: &'a str,
    /// Empty if no point is finite.
    pictures: Vec<PictureView>,
    obstacles: Vec<ObstacleView<'a>>,
    /// There is an approach or a return.
    aside: bool,
    /// Points left out because they are not finite.
    missing: usize,
}

#[derive(Debug, Serialize)]
struct PictureView {
    title: &'static str,
    width: f64,
    svg: String,
}

#[derive(Debug, Serialize)]
struct ObstacleView<'a> {
    name: &'a str,
    text: String,
}

pub(super) fn paths(data: &DesignReport) -> Vec<PathView<'_>> {
    let Some(trajectory) = &data.trajectory else { return Vec::new() };
    let frames = trajectory.frames.iter().enumerate();
    frames.map(|(id, frame)| path(data, trajectory, id, frame)).collect()
}

fn path<'a>(
    data: &'a DesignReport,
    trajectory: &'a Trajectory,
    id: usize,
    frame: &'a FramePath,
) -> PathView<'a> {
    let parts = parts(trajectory, data.period_s, &frame.xyz_m);
    let obstacles: Vec<&Obstacle> =
        data.obstacles.iter().filter(|o| o.frames.is_empty() || o.frames.contains(&frame.name)).collect();
    let shapes: Vec<Shape> = obstacles.iter().map(|o| o.shape).collect();
    PathView {
        frame: &frame.name,
        pictures: view_pictures(id, parts, &shapes)
            .into_iter()
            .map(|picture| PictureView { title: title(picture.view), width: picture.width, svg: picture.svg })
            .collect(),
        obstacles: obstacles
            .iter()
            .map(|o| ObstacleView { name: &o.name, text: in_words(&o.shape) })
            .collect(),
        aside: !(parts.approach.is_empty() && parts.back.is_empty()),
        missing: frame.xyz_m.iter().filter(|p| p.iter().any(|x| !x.is_finite())).count(),
    }
}

/// Approach, first period of the recorded part (the others lie on it), return; neighbours share a point.
fn parts<'a>(trajectory: &Trajectory, period_s: Option<f64>, xyz: &'a [[f64; 3]]) -> PathParts<'a> {
    let time = &trajectory.time_s;
    let (Some(&first), Some(&last)) = (time.first(), time.last()) else { return PathParts::default() };
    let [start, end] = trajectory.recorded_s.unwrap_or([first, last]);
    let until = |t: f64| time.partition_point(|x| *x <= t + 1e-9 * (last - first));
    let begin = time.partition_point(|x| *x < start - 1e-9 * (last - first));
    let finish = until(end).max(begin);
    let period_end = period_s.filter(|p| *p > 0.0).map_or(finish, |p| until(start + p).clamp(begin, finish));
    PathParts {
        approach: if begin > 0 { &xyz[..(begin + 1).min(xyz.len())] } else { &[] },
        recorded: &xyz[begin..period_end],
        back: if finish < xyz.len() { &xyz[finish.saturating_sub(1)..] } else { &[] },
    }
}

fn title(view: View) -> &'static str {
    match view {
        View::Top => "From above",
        View::Front => "From the front (+x)",
        View::Side => "From the side (−y)",
    }
}

fn in_words(shape: &Shape) -> String {
    let range = |lower: &[f64; 3], upper: &[f64; 3]| {
        let axis =
            |k: usize| format!("{} {} to {}", ["x", "y", "z"][k], shortest(lower[k]), shortest(upper[k]));
        [0, 1, 2].map(axis).join(", ")
    };
    let upright = |center: &[f64; 2], radius: f64| {
        format!(
            "of radius {} m around x {}, y {} m",
            shortest(radius),
            shortest(center[0]),
            shortest(center[1])
        )
    };
    match shape {
        Shape::HalfSpace { normal, offset_m } => half_space(*normal, *offset_m),
        Shape::InsideBox { lower_m, upper_m } => format!("inside the box {} m", range(lower_m, upper_m)),
        Shape::OutsideBox { lower_m, upper_m } => format!("outside the box {} m", range(lower_m, upper_m)),
        Shape::OutsideCylinder { center_m, radius_m } => {
            format!("outside the upright cylinder {}", upright(center_m, *radius_m))
        }
        Shape::OutsideOrAboveColumn { center_m, radius_m, height_m } => format!(
            "outside or above the upright column {}, top at z {} m",
            upright(center_m, *radius_m),
            shortest(*height_m)
        ),
    }
}

fn half_space(normal: [f64; 3], offset: f64) -> String {
    let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
    let used: Vec<usize> = (0..3).filter(|k| normal[*k] != 0.0).collect();
    if let [axis] = used[..] {
        let name = ["x", "y", "z"][axis];
        return if normal[axis] > 0.0 {
            format!("where {name} ≥ {} m", shortest(offset))
        } else {
            format!("where {name} ≤ {} m", shortest(-offset + 0.0))
        };
    }
    let term = |k: &usize| format!("{} {}", shortest(normal[*k] / length), ["x", "y", "z"][*k]);
    let sum = used.iter().map(term).collect::<Vec<_>>().join(" + ").replace("+ -", "− ");
    format!("where {sum} ≥ {} m", shortest(offset))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_is_cut_where_the_record_begins_and_after_one_period() {
        let trajectory = Trajectory {
            time_s: (0..=10).map(f64::from).collect(),
            recorded_s: Some([2.0, 8.0]),
            ..Trajectory::default()
        };
        let xyz: Vec<[f64; 3]> = (0..=10).map(|k| [f64::from(k), 0.0, 0.0]).collect();
        let ends = |p: &[[f64; 3]]| [p[0][0], p[p.len() - 1][0]];
        let cut = parts(&trajectory, Some(3.0), &xyz);
        assert_eq!(
            [ends(cut.approach), ends(cut.recorded), ends(cut.back)],
            [[0.0, 2.0], [2.0, 5.0], [8.0, 10.0]]
        );
        let cut = parts(&trajectory, None, &xyz);
        assert_eq!(ends(cut.recorded), [2.0, 8.0]);
        let cut = parts(&Trajectory { recorded_s: None, ..trajectory }, None, &xyz);
        assert!(cut.approach.is_empty() && cut.back.is_empty());
        assert_eq!(ends(cut.recorded), [0.0, 10.0]);
    }

    #[test]
    fn shapes_are_told_in_words() {
        let plane = |normal, offset_m| in_words(&Shape::HalfSpace { normal, offset_m });
        assert_eq!(plane([0.0, 0.0, 3.0], 0.05), "where z ≥ 0.05 m");
        assert_eq!(plane([-1.0, 0.0, 0.0], -0.8), "where x ≤ 0.8 m");
        assert_eq!(plane([0.0, -0.6, 0.8], 0.1), "where -0.6 y + 0.8 z ≥ 0.1 m");
        assert_eq!(plane([3.0, 0.0, -4.0], 0.1), "where 0.6 x − 0.8 z ≥ 0.1 m");
        let column = Shape::OutsideOrAboveColumn { center_m: [0.0, 0.5], radius_m: 0.2, height_m: 0.4 };
        assert_eq!(
            in_words(&column),
            "outside or above the upright column of radius 0.2 m around x 0, y 0.5 m, top at z 0.4 m"
        );
    }
}
