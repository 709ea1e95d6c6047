//! The path of a frame from above, from the front and from the side, at one scale, among its obstacles.

mod obstacle;

use super::axis::{tick_label, ticks};
use crate::data::Shape;

const LEFT: f64 = 40.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 18.0;
const BOTTOM: f64 = 34.0;
/// Width that the three pictures share, in pixels at full size.
const ROW: f64 = 1050.0;
/// Height of the tallest plot area.
const TALLEST: f64 = 330.0;
/// An extent is drawn at least this share of the largest.
const LEAST_SHARE: f64 = 0.3;
/// Obstacles widen the picture by at most this share of the path's largest extent.
const REACH: f64 = 0.6;
/// Neighbouring corners of a drawn path lie this far apart, in pixels.
const SPACING: f64 = 1.5;

/// Where one looks from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum View {
    /// From above: `x` to the right, `y` up.
    Top,
    /// From `+x`: `y` to the right, `z` up.
    Front,
    /// From `-y`: `x` to the right, `z` up.
    Side,
}

impl View {
    pub(crate) const ALL: [View; 3] = [View::Top, View::Front, View::Side];

    /// Axis to the right, axis up, axis of sight.
    fn axes(self) -> [usize; 3] {
        match self {
            View::Top => [0, 1, 2],
            View::Front => [1, 2, 0],
            View::Side => [0, 2, 1],
        }
    }
}

/// A path cut into what is recorded and what is not, m.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PathParts<'a> {
    pub(crate) approach: &'a [[f64; 3]],
    pub(crate) recorded: &'a [[f64; 3]],
    pub(crate) back: &'a [[f64; 3]],
}

/// One picture and its width in pixels at full size.
#[derive(Debug)]
pub(crate) struct ViewPicture {
    pub(crate) view: View,
    pub(crate) width: f64,
    pub(crate) svg: String,
}

/// The three views; `id` tells the pictures of one page apart. Empty if no point of the path is finite.
pub(crate) fn view_pictures(id: usize, parts: PathParts<'_>, shapes: &[Shape]) -> Vec<ViewPicture> {
    let Some(space) = space(parts, shapes) else { return Vec::new() };
    let [x, y, z] = [0, 1, 2].map(|k| space[k][1] - space[k][0]);
    let scale = ((ROW - 3.0 * (LEFT + RIGHT)) / (2.0 * x + y)).min(TALLEST / y.max(z));
    View::ALL
        .into_iter()
        .enumerate()
        .map(|(k, view)| {
            let [h, v, _] = view.axes();
            let sheet = Sheet { view, h: space[h], v: space[v], scale };
            ViewPicture {
                view,
                width: sheet.width(),
                svg: sheet.draw(&format!("view-{id}-{k}"), parts, shapes),
            }
        })
        .collect()
}

/// Lower and upper end of each axis: around the path and the robot's base, and around the obstacles within reach.
fn space(parts: PathParts<'_>, shapes: &[Shape]) -> Option<[[f64; 2]; 3]> {
    let points = || {
        let all = parts.approach.iter().chain(parts.recorded).chain(parts.back);
        all.filter(|p| p.iter().all(|x| x.is_finite()))
    };
    points().next()?;
    let mut space: [[f64; 2]; 3] = std::array::from_fn(|k| {
        points().fold([0.0, 0.0], |[low, high]: [f64; 2], p| [low.min(p[k]), high.max(p[k])])
    });
    let largest = |space: &[[f64; 2]; 3]| space.iter().map(|[a, b]| b - a).fold(0.0, f64::max);
    let path = space;
    let reach = REACH * largest(&path);
    for shape in shapes {
        for (k, [low, high]) in obstacle::extent(shape).into_iter().enumerate() {
            space[k][0] = space[k][0].min(low.max(path[k][0] - reach));
            space[k][1] = space[k][1].max(high.min(path[k][1] + reach));
        }
    }
    let whole = if largest(&space) > 0.0 { largest(&space) } else { 1.0 };
    Some(space.map(|[low, high]| {
        let pad = (0.5 * (LEAST_SHARE * whole - (high - low))).max(0.05 * whole);
        [low - pad, high + pad]
    }))
}

/// The area of one view, m, and its scale, pixels per m.
struct Sheet {
    view: View,
    h: [f64; 2],
    v: [f64; 2],
    scale: f64,
}

impl Sheet {
    fn width(&self) -> f64 {
        LEFT + (self.h[1] - self.h[0]) * self.scale + RIGHT
    }

    fn floor(&self) -> f64 {
        TOP + (self.v[1] - self.v[0]) * self.scale
    }

    /// Pixels of a place in the view.
    fn at(&self, h: f64, v: f64) -> [f64; 2] {
        [LEFT + (h - self.h[0]) * self.scale, self.floor() - (v - self.v[0]) * self.scale]
    }

    fn draw(&self, id: &str, parts: PathParts<'_>, shapes: &[Shape]) -> String {
        let (width, floor) = (self.width(), self.floor());
        let (height, end) = (floor + BOTTOM, width - RIGHT);
        let [h, v, _] = self.view.axes().map(|axis| ["x", "y", "z"][axis]);
        let mut svg = format!(
            r#"<svg class="view" viewBox="0 0 {width:.1} {height:.1}" role="img" aria-label="Path in {h} and {v}"><clipPath id="{id}"><rect x="{LEFT}" y="{TOP}" width="{:.1}" height="{:.1}"/></clipPath>"#,
            end - LEFT,
            floor - TOP
        );
        self.axes(&mut svg);
        svg.push_str(&format!(r#"<g clip-path="url(#{id})">"#));
        for shape in shapes {
            obstacle::draw(self, shape, &mut svg);
        }
        for (class, points) in
            [("aside", parts.approach), ("aside", parts.back), ("recorded", parts.recorded)]
        {
            let d = self.line(points);
            if !d.is_empty() {
                svg.push_str(&format!(r#"<path class="{class}" d="{d}"/>"#));
            }
        }
        let [x, y] = self.at(0.0, 0.0);
        svg.push_str(&format!(r#"<path class="base" d="M{:.1} {y:.1}h12m-6 -6v12"/>"#, x - 6.0));
        let first = parts.approach.first().or(parts.recorded.first());
        if let Some(p) = first.filter(|p| p.iter().all(|x| x.is_finite())) {
            let [x, y] = self.place(*p);
            svg.push_str(&format!(r#"<circle class="start" cx="{x:.1}" cy="{y:.1}" r="3.2"/>"#));
        }
        svg.push_str("</g></svg>");
        svg
    }

    fn axes(&self, svg: &mut String) {
        let (floor, end) = (self.floor(), self.width() - RIGHT);
        let wished = |range: [f64; 2]| ((range[1] - range[0]) * self.scale / 55.0).clamp(2.0, 8.0);
        for t in ticks(self.h[0], self.h[1], wished(self.h)) {
            let [x, _] = self.at(t, 0.0);
            svg.push_str(&format!(
                r#"<path class="grid" d="M{x:.1} {TOP}V{floor:.1}"/><text x="{x:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
                floor + 14.0,
                tick_label(t)
            ));
        }
        for t in ticks(self.v[0], self.v[1], wished(self.v)) {
            let [_, y] = self.at(0.0, t);
            svg.push_str(&format!(
                r#"<path class="grid" d="M{LEFT} {y:.1}H{end:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
                LEFT - 5.0,
                y + 3.5,
                tick_label(t)
            ));
        }
        let [h, v, _] = self.view.axes().map(|axis| ["x", "y", "z"][axis]);
        svg.push_str(&format!(
            r#"<path class="axis" d="M{LEFT} {TOP}V{floor:.1}H{end:.1}"/><text class="name" x="{end:.1}" y="{:.1}" text-anchor="end">{h} m</text><text class="name" x="{LEFT}" y="11" text-anchor="end">{v} m</text>"#,
            floor + 29.0
        ));
    }

    fn place(&self, p: [f64; 3]) -> [f64; 2] {
        let [h, v, _] = self.view.axes();
        self.at(p[h], p[v])
    }

    /// Path through `points`, broken where one is not finite, thinned to what can be seen: a point near the last one drawn
    /// waits, and is drawn after all if the path turns back from there.
    fn line(&self, points: &[[f64; 3]]) -> String {
        let mut d = String::new();
        let mut push = |letter: char, [x, y]: [f64; 2]| d.push_str(&format!("{letter}{x:.1} {y:.1}"));
        let mut drawn: Option<[f64; 2]> = None;
        let mut waiting: Option<([f64; 2], f64)> = None;
        for p in points {
            let here = self.place(*p);
            if !p.iter().all(|x| x.is_finite()) {
                waiting.take().into_iter().for_each(|(end, _)| push('L', end));
                drawn = None;
                continue;
            }
            let Some(last) = drawn else {
                push('M', here);
                drawn = Some(here);
                continue;
            };
            let mut away = distance(last, here);
            if let Some((corner, _)) = waiting.take().filter(|(_, farthest)| away < *farthest) {
                push('L', corner);
                drawn = Some(corner);
                away = distance(corner, here);
            }
            if away >= SPACING {
                push('L', here);
                drawn = Some(here);
            } else {
                waiting = Some((here, away));
            }
        }
        waiting.into_iter().for_each(|(end, _)| push('L', end));
        d
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle() -> Vec<[f64; 3]> {
        (0..=1000)
            .map(|k| f64::from(k) * 0.001 * std::f64::consts::TAU)
            .map(|a| [a.cos(), a.sin(), 0.5])
            .collect()
    }

    fn pictures(shapes: &[Shape]) -> Vec<ViewPicture> {
        let path = circle();
        view_pictures(0, PathParts { recorded: &path, ..PathParts::default() }, shapes)
    }

    #[test]
    fn a_circle_is_round_and_has_the_same_size_in_every_view() {
        let spans: Vec<[f64; 2]> = pictures(&[])
            .iter()
            .map(|p| {
                let d = p.svg.split(r#"class="recorded" d="M"#).nth(1).unwrap().split('"').next().unwrap();
                let corners = d.split('L').map(|c| c.split_once(' ').unwrap());
                let span = |values: Vec<f64>| {
                    values.iter().copied().fold(f64::MIN, f64::max)
                        - values.iter().copied().fold(f64::MAX, f64::min)
                };
                let (x, y): (Vec<f64>, Vec<f64>) =
                    corners.map(|(x, y)| (x.parse::<f64>().unwrap(), y.parse::<f64>().unwrap())).unzip();
                [span(x), span(y)]
            })
            .collect();
        // Within the rounding of both ends to 0.1.
        let near = |a: f64, b: f64| assert!((a - b).abs() < 0.21, "{a} {b}");
        near(spans[0][0], spans[0][1]);
        near(spans[0][0], spans[1][0]);
        near(spans[0][0], spans[2][0]);
        assert_eq!(spans[1][1], 0.0);
        assert!(spans[0][0] > 200.0);
    }

    #[test]
    fn the_row_is_not_wider_than_its_room() {
        assert!(pictures(&[]).iter().map(|p| p.width).sum::<f64>() <= ROW + 1e-9);
    }

    #[test]
    fn far_obstacles_do_not_shrink_the_path() {
        let far = Shape::InsideBox { lower_m: [-50.0; 3], upper_m: [50.0; 3] };
        let path = circle();
        let parts = PathParts { recorded: &path, ..PathParts::default() };
        let space = space(parts, &[far]).unwrap();
        assert!(space.iter().all(|[low, high]| *low > -2.5 && *high < 2.5), "{space:?}");
    }

    #[test]
    fn a_path_without_a_finite_point_makes_no_picture() {
        let nothing = [[f64::NAN; 3]];
        assert!(view_pictures(0, PathParts { recorded: &nothing, ..PathParts::default() }, &[]).is_empty());
        assert!(view_pictures(0, PathParts::default(), &[]).is_empty());
    }
}
