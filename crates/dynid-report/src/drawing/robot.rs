//! The robot as lines, seen from the side and a little from above.

use crate::data::{LineKind, PointKind, RobotPicture};

/// Size of the picture at full size, pixels.
pub(crate) const WIDTH: f64 = 320.0;
pub(crate) const HEIGHT: f64 = 280.0;
const MARGIN: f64 = 14.0;
/// Height of the eye over the plane of the base, rad.
const ELEVATION: f64 = 0.36;
/// Directions that are tried, rad apart.
const TURNS: usize = 12;

/// An axonometric view: picture coordinates of a point `p` are `x = at[0] + right·p`, `y = at[1] - above·p`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    /// Pixels to the right per metre along each base axis.
    pub(crate) right: [f64; 3],
    /// Pixels upwards per metre along each base axis.
    pub(crate) above: [f64; 3],
    /// Unit vector upwards in base axes.
    pub(crate) up: [f64; 3],
    /// Place of the base.
    pub(crate) at: [f64; 2],
}

impl View {
    /// The view in which the motion is spread widest; `None` if no point is finite, or all are the base.
    pub(crate) fn of(picture: &RobotPicture) -> Option<View> {
        let up = unit(picture.up).unwrap_or([0.0, 0.0, 1.0]);
        let marked = |k: &usize| !matches!(picture.points.get(*k), Some(PointKind::End));
        let ends: Vec<usize> = picture
            .lines
            .iter()
            .filter(|line| line.kind != LineKind::Axis)
            .flat_map(|line| line.ends)
            .chain((0..picture.points.len()).filter(marked))
            .collect();
        let points: Vec<[f64; 3]> = picture
            .poses
            .iter()
            .flat_map(|pose| ends.iter().filter_map(|k| pose.points_m.get(*k).copied()))
            .filter(|p| p.iter().all(|x| x.is_finite()))
            .collect();
        let largest = points.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        let step = std::f64::consts::TAU / TURNS as f64;
        // The first of equals, which is the customary view with x to the right and towards the reader.
        let mut best: Option<(f64, View)> = None;
        for turn in 0..TURNS {
            let (view, spread) = View::fitted(up, -0.6 + step * turn as f64, &points);
            if best.as_ref().is_none_or(|(most, _)| spread > most * 1.05) {
                best = Some((spread, view));
            }
        }
        best.map(|(_, view)| view)
    }

    /// The view from a direction, as large as the picture lets it, and the area that the points span before, m².
    fn fitted(up: [f64; 3], azimuth: f64, points: &[[f64; 3]]) -> (View, f64) {
        let (ahead, aside) = plane(up);
        let (sin, cos) = azimuth.sin_cos();
        let right = combine(ahead, cos, aside, sin);
        let depth = combine(ahead, -sin, aside, cos);
        let above = combine(up, ELEVATION.cos(), depth, ELEVATION.sin());
        let span = |axis: [f64; 3]| {
            points
                .iter()
                .map(|p| dot(axis, *p))
                .fold([0.0, 0.0], |[low, high]: [f64; 2], x| [low.min(x), high.max(x)])
        };
        let (x, y) = (span(right), span(above));
        let (wide, tall) = (x[1] - x[0], y[1] - y[0]);
        let scale = ((WIDTH - 2.0 * MARGIN) / wide).min((HEIGHT - 2.0 * MARGIN) / tall);
        let at = [0.5 * WIDTH - 0.5 * scale * (x[0] + x[1]), 0.5 * HEIGHT + 0.5 * scale * (y[0] + y[1])];
        let view = View { right: right.map(|x| x * scale), above: above.map(|x| x * scale), up, at };
        (view, wide * tall)
    }

    /// Place of a point in the picture.
    pub(crate) fn place(&self, p: [f64; 3]) -> [f64; 2] {
        [self.at[0] + dot(self.right, p), self.at[1] - dot(self.above, p)]
    }

    /// A point moved along gravity into the plane of the base.
    fn shadow(&self, p: [f64; 3]) -> [f64; 3] {
        combine(p, 1.0, self.up, -dot(self.up, p))
    }
}

/// The picture of one pose, its parts under classes by which a script moves them; empty if there is nothing to draw.
///
/// `label`: what it shows, free of markup.
pub(crate) fn robot_svg(picture: &RobotPicture, label: &str) -> String {
    let (Some(view), Some(pose)) = (View::of(picture), picture.poses.get(picture.shown)) else {
        return String::new();
    };
    let mut svg =
        format!(r#"<svg class="robot" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">"#);
    svg.push_str(&ground(&view, picture));
    if let Some(trail) = picture.trail {
        let path = picture.poses.iter().filter_map(|pose| pose.points_m.get(trail)).map(|p| view.place(*p));
        svg.push_str(&format!(r#"<path class="trail" d="{}"/>"#, polyline(path)));
    }
    let lines = |kind: LineKind, shadow: bool| -> String {
        let mut d = String::new();
        for line in picture.lines.iter().filter(|line| line.kind == kind) {
            let ends = line.ends.map(|k| pose.points_m.get(k).copied().unwrap_or([f64::NAN; 3]));
            let ends = ends.map(|p| view.place(if shadow { view.shadow(p) } else { p }));
            if ends.iter().flatten().all(|x| x.is_finite()) {
                d.push_str(&format!(
                    "M{:.1} {:.1}L{:.1} {:.1}",
                    ends[0][0], ends[0][1], ends[1][0], ends[1][1]
                ));
            }
        }
        d
    };
    svg.push_str(&format!(r#"<path class="shadow" d="{}"/>"#, lines(LineKind::Link, true)));
    for (kind, class) in [(LineKind::Link, "link"), (LineKind::Mass, "mass"), (LineKind::Axis, "axis")] {
        svg.push_str(&format!(r#"<path class="{class}" d="{}"/>"#, lines(kind, false)));
    }
    for (kind, p) in picture.points.iter().zip(&pose.points_m) {
        let Some((class, radius)) = mark(*kind) else { continue };
        let [x, y] = view.place(*p);
        if x.is_finite() && y.is_finite() {
            svg.push_str(&format!(r#"<circle class="{class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"/>"#));
        }
    }
    svg.push_str("</svg>");
    svg
}

/// Class and radius of the mark of a point.
pub(crate) fn mark(kind: PointKind) -> Option<(&'static str, f64)> {
    match kind {
        PointKind::End => None,
        PointKind::Base => Some(("base", 5.0)),
        PointKind::Turns => Some(("turns", 4.5)),
        PointKind::Slides => Some(("slides", 4.5)),
        PointKind::Mass => Some(("centre", 3.0)),
    }
}

/// A ring in the plane of the base, as wide as the robot reaches, and the axes of the base.
fn ground(view: &View, picture: &RobotPicture) -> String {
    let reach = picture
        .poses
        .iter()
        .flat_map(|pose| &pose.points_m)
        .map(|p| view.shadow(*p))
        .map(|p| dot(p, p).sqrt())
        .filter(|r| r.is_finite())
        .fold(0.0, f64::max);
    let (ahead, aside) = plane(view.up);
    let radius = reach.max(1e-9) * 0.45;
    let corner = |k: usize| {
        let (sin, cos) = (std::f64::consts::TAU * k as f64 / 48.0).sin_cos();
        view.place(combine(ahead, radius * cos, aside, radius * sin))
    };
    let mut svg = format!(r#"<path class="ground" d="{}Z"/>"#, polyline((0..48).map(corner)));
    let per_metre = dot(view.right, view.right).sqrt().max(f64::MIN_POSITIVE);
    let length = 34.0 / per_metre;
    for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
        let mut axis = [0.0; 3];
        axis[k] = length;
        let ([x0, y0], [x, y]) = (view.at, view.place(axis));
        let [tx, ty] = view.place(axis.map(|a| a * 1.3));
        svg.push_str(&format!(
            r#"<path class="triad" d="M{x0:.1} {y0:.1}L{x:.1} {y:.1}"/><text x="{tx:.1}" y="{:.1}" text-anchor="middle">{name}</text>"#,
            ty + 3.5
        ));
    }
    svg
}

fn polyline(points: impl Iterator<Item = [f64; 2]>) -> String {
    let mut d = String::new();
    for [x, y] in points.filter(|p| p.iter().all(|x| x.is_finite())) {
        d.push_str(&format!("{}{x:.1} {y:.1}", if d.is_empty() { "M" } else { "L" }));
    }
    d
}

/// Two directions across `up`, the first as near to `x` as may be (to `z`, if `x` points upwards).
fn plane(up: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let across = |v: [f64; 3]| unit(combine(v, 1.0, up, -dot(up, v)));
    let near_x = if up[0].abs() < 0.9 { across([1.0, 0.0, 0.0]) } else { across([0.0, 0.0, -1.0]) };
    let ahead = near_x.unwrap_or([0.0, 1.0, 0.0]);
    let aside = [
        up[1] * ahead[2] - up[2] * ahead[1],
        up[2] * ahead[0] - up[0] * ahead[2],
        up[0] * ahead[1] - up[1] * ahead[0],
    ];
    (ahead, aside)
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn combine(a: [f64; 3], by: f64, b: [f64; 3], with: f64) -> [f64; 3] {
    std::array::from_fn(|k| by * a[k] + with * b[k])
}

fn unit(v: [f64; 3]) -> Option<[f64; 3]> {
    let length = dot(v, v).sqrt();
    (length > 0.0 && length.is_finite()).then(|| v.map(|x| x / length))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::{PictureLine, Pose};

    fn arm(up: [f64; 3], tip: [f64; 3]) -> RobotPicture {
        RobotPicture {
            points: vec![PointKind::Base, PointKind::Turns, PointKind::End],
            lines: vec![
                PictureLine { ends: [0, 1], kind: LineKind::Link },
                PictureLine { ends: [1, 2], kind: LineKind::Link },
            ],
            up,
            poses: vec![Pose { time_s: 0.0, points_m: vec![[0.0; 3], [0.0, 0.0, 0.5], tip] }],
            ..RobotPicture::default()
        }
    }

    #[test]
    fn up_is_up_and_everything_is_inside() {
        for up in [[0.0, 0.0, 1.0], [0.0, 0.0, 9.81], [1.0, 0.0, 0.0], [0.0; 3]] {
            let picture = arm(up, [0.4, 0.3, 0.2]);
            let view = View::of(&picture).unwrap();
            let base = view.place([0.0; 3]);
            let over = view.place(view.up.map(|x| 0.1 * x));
            assert!((over[0] - base[0]).abs() < 1e-9 && over[1] < base[1], "{up:?}");
            for p in &picture.poses[0].points_m {
                let [x, y] = view.place(*p);
                assert!((0.0..=WIDTH).contains(&x) && (0.0..=HEIGHT).contains(&y), "{up:?} {x} {y}");
            }
        }
    }

    #[test]
    fn lengths_across_the_sight_are_true_to_scale() {
        let view = View::of(&arm([0.0, 0.0, 1.0], [0.7, 0.0, 0.5])).unwrap();
        let pixels = |v: [f64; 3]| dot(v, v).sqrt();
        // Columns of an axonometric view of unit vectors: their squares add up to two squared scales.
        let sum: f64 = (0..3).map(|k| view.right[k].powi(2) + view.above[k].powi(2)).sum();
        assert!((sum - 2.0 * pixels(view.right).powi(2)).abs() < 1e-9 * sum);
    }

    #[test]
    fn nothing_to_draw_is_no_picture() {
        assert_eq!(robot_svg(&RobotPicture::default(), ""), "");
        assert_eq!(robot_svg(&arm([0.0, 0.0, 1.0], [f64::NAN; 3]), "x").matches("NaN").count(), 0);
        let mut flat = arm([0.0, 0.0, 1.0], [0.0; 3]);
        flat.poses[0].points_m = vec![[0.0; 3]; 3];
        assert_eq!(robot_svg(&flat, ""), "");
    }
}
