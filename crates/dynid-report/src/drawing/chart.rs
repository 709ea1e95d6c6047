//! Line charts with two axes.

use super::axis::{tick_label, ticks};
use crate::data::{Chart, ChartAxis, ChartCurve, CurveStyle};
use crate::markup::escape;

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 270.0;
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 8.0;
const BOTTOM: f64 = 24.0;
/// Curves with more points are thinned to the least and greatest of each pixel, or evenly if they run back and forth.
const MOST_POINTS: usize = 1600;
/// Up to so many dots are drawn large.
const FEW_DOTS: usize = 40;
/// Classes of lines, in order, then again from the first.
const COLOURS: usize = 6;
/// Class of dots that have their names beside them.
const NAMED: usize = 0;

/// Picture of a chart; empty if no point can be drawn.
pub(crate) fn chart_svg(chart: &Chart) -> String {
    let curves: Vec<Vec<[f64; 2]>> = chart.curves.iter().map(|c| scaled(chart, c)).collect();
    let finite = || curves.iter().flatten().filter(|p| p[0].is_finite() && p[1].is_finite());
    let range =
        |k: usize| finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| (a.min(p[k]), b.max(p[k])));
    if finite().next().is_none() {
        return String::new();
    }
    let mut x = Scale::new(&chart.x, range(0), 0.0);
    let mut y = Scale::new(&chart.y, range(1), 0.05);
    let (width, height) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
    if chart.equal_units {
        let unit = ((x.high - x.low) / width).max((y.high - y.low) / height);
        x.widen(unit * width);
        y.widen(unit * height);
    }
    let px = |v: f64| LEFT + (v - x.low) / (x.high - x.low) * width;
    let py = |v: f64| TOP + (y.high - v) / (y.high - y.low) * height;
    let mut svg = format!(
        r#"<svg class="chart" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{}">"#,
        escape(&chart.title)
    );
    let floor = HEIGHT - BOTTOM;
    for (value, text) in y.ticks(5.0) {
        let at = py(value);
        svg.push_str(&format!(
            r#"<path class="grid" d="M{LEFT} {at:.1}H{:.1}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{text}</text>"#,
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 3.5
        ));
    }
    for (value, text) in x.ticks(6.0) {
        let at = px(value);
        let anchor = if at > WIDTH - 30.0 { "end" } else { "middle" };
        svg.push_str(&format!(
            r#"<path class="grid" d="M{at:.1} {TOP}V{floor}"/><text x="{at:.1}" y="{:.1}" text-anchor="{anchor}">{text}</text>"#,
            floor + 15.0
        ));
    }
    svg.push_str(&format!(r#"<path class="axis" d="M{LEFT} {TOP}V{floor}H{:.1}"/>"#, WIDTH - RIGHT));
    for (k, (curve, points)) in chart.curves.iter().zip(&curves).enumerate() {
        let class = if curve.style == CurveStyle::Named { NAMED } else { k % COLOURS };
        let points: Vec<[f64; 2]> = thinned(points).iter().map(|p| [px(p[0]), py(p[1])]).collect();
        match curve.style {
            CurveStyle::Dots | CurveStyle::Named => {
                let radius = if points.len() <= FEW_DOTS { 3.0 } else { 1.6 };
                for p in points.iter().filter(|p| p[0].is_finite() && p[1].is_finite()) {
                    svg.push_str(&format!(
                        r#"<circle class="c{class}" cx="{:.1}" cy="{:.1}" r="{radius}"/>"#,
                        p[0], p[1]
                    ));
                }
            }
            style => {
                let dashed = if style == CurveStyle::Dashed { " dashed" } else { "" };
                svg.push_str(&format!(r#"<path class="curve c{class}{dashed}" d="{}"/>"#, line(&points)));
            }
        }
    }
    svg.push_str(&labels(chart, &px, &py));
    svg.push_str("</svg>");
    svg
}

/// Height of a line of names.
const LINE: f64 = 12.0;

/// Names beside their points, on the left of those near the right end, moved down where they would lie on each other.
fn labels(chart: &Chart, px: &dyn Fn(f64) -> f64, py: &dyn Fn(f64) -> f64) -> String {
    let named = chart.curves.iter().filter(|curve| curve.style == CurveStyle::Named);
    let points = named.flat_map(|curve| curve.points.iter().map(|p| (place(chart, *p), curve.name.as_str())));
    let mut placed: Vec<([f64; 2], &str)> = points
        .map(|([x, y], text)| ([px(x), py(y)], text))
        .filter(|([x, y], _)| x.is_finite() && y.is_finite())
        .collect();
    placed.sort_by(|a, b| a.0[1].total_cmp(&b.0[1]));
    let mut taken: Vec<[f64; 3]> = Vec::new();
    let mut svg = String::new();
    for ([x, y], text) in placed {
        let width = 6.2 * text.chars().count() as f64;
        let left = x + 8.0 + width > WIDTH - RIGHT;
        let from = if left { x - 8.0 - width } else { x + 8.0 };
        let mut at = y + 4.0;
        // Less than a line, or the rounding of a place a line below would pass for lying on it for ever.
        let lies_on =
            |at: f64, t: &[f64; 3]| (t[2] - at).abs() < 0.95 * LINE && t[0] < from + width && from < t[1];
        while let Some(other) = taken.iter().find(|t| lies_on(at, t)) {
            at = other[2] + LINE;
        }
        taken.push([from, from + width, at]);
        let (place, anchor) = if left { (x - 8.0, "end") } else { (x + 8.0, "start") };
        svg.push_str(&format!(
            r#"<text class="label" x="{place:.1}" y="{at:.1}" text-anchor="{anchor}">{}</text>"#,
            escape(text)
        ));
    }
    svg
}

fn scaled(chart: &Chart, curve: &ChartCurve) -> Vec<[f64; 2]> {
    curve.points.iter().map(|p| place(chart, *p)).collect()
}

/// A point on the scales of a chart.
fn place(chart: &Chart, p: [f64; 2]) -> [f64; 2] {
    let scale = |axis: &ChartAxis, v: f64| match axis.logarithmic {
        true if v > 0.0 => v.log10(),
        true => f64::NAN,
        false => v,
    };
    [scale(&chart.x, p[0]), scale(&chart.y, p[1])]
}

/// A drawn axis: its ends, as logarithms on a logarithmic one.
pub(super) struct Scale {
    pub(super) low: f64,
    pub(super) high: f64,
    logarithmic: bool,
}

impl Scale {
    pub(super) fn new(axis: &ChartAxis, (low, high): (f64, f64), margin: f64) -> Self {
        let least = if axis.logarithmic { 0.1 } else { 1e-9 * low.abs().max(high.abs()).max(1e-9) };
        let spread = (high - low).max(least);
        let middle = 0.5 * (low + high);
        let half = (0.5 + margin) * spread;
        Scale { low: middle - half, high: middle + half, logarithmic: axis.logarithmic }
    }

    /// Place of a value on the drawn scale.
    pub(super) fn of(&self, value: f64) -> f64 {
        if self.logarithmic { value.log10() } else { value }
    }

    /// Value at a place on the drawn scale.
    pub(super) fn back(&self, place: f64) -> f64 {
        if self.logarithmic { 10f64.powf(place) } else { place }
    }

    fn widen(&mut self, length: f64) {
        let middle = 0.5 * (self.low + self.high);
        (self.low, self.high) = (middle - 0.5 * length, middle + 0.5 * length);
    }

    /// Places on the drawn scale with their texts.
    pub(super) fn ticks(&self, wished: f64) -> Vec<(f64, String)> {
        let (low, high) = (self.low, self.high);
        if !self.logarithmic {
            return ticks(low, high, wished).into_iter().map(|v| (v, tick_label(v))).collect();
        }
        let factors: &[f64] = if high - low > 4.0 {
            &[1.0]
        } else if high - low > 1.2 {
            &[1.0, 3.0]
        } else {
            &[1.0, 1.5, 2.0, 3.0, 5.0, 7.0]
        };
        let step = (((high - low) / (2.0 * wished)).floor() as i32).max(1);
        (low.floor() as i32..=high.ceil() as i32)
            .filter(|power| power % step == 0)
            .flat_map(|power| factors.iter().map(move |f| f * 10f64.powi(power)))
            .filter(|v| (low..=high).contains(&v.log10()))
            .map(|v| (v.log10(), tick_label(v)))
            .collect()
    }
}

/// Least and greatest of stretches where the points run along the axis, every n-th point where they do not.
fn thinned(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    if points.len() <= MOST_POINTS {
        return points.to_vec();
    }
    let stretch = points.len().div_ceil(MOST_POINTS / 2);
    if points.windows(2).any(|p| p[1][0] < p[0][0]) {
        let last = points.last().copied();
        return points.iter().step_by(stretch.div_ceil(2)).copied().chain(last).collect();
    }
    points
        .chunks(stretch)
        .flat_map(|chunk| {
            let by = |a: &usize, b: &usize| chunk[*a][1].total_cmp(&chunk[*b][1]);
            let least = (0..chunk.len()).min_by(by).unwrap_or(0);
            let most = (0..chunk.len()).max_by(by).unwrap_or(0);
            [chunk[least.min(most)], chunk[least.max(most)]]
        })
        .collect()
}

fn line(points: &[[f64; 2]]) -> String {
    let mut path = String::new();
    let mut pen = false;
    for [x, y] in points {
        if !(x.is_finite() && y.is_finite()) {
            pen = false;
            continue;
        }
        path.push_str(&format!("{}{x:.1} {y:.1}", if pen { "L" } else { "M" }));
        pen = true;
    }
    path
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>, logarithmic: bool) -> Chart {
        Chart {
            y: ChartAxis { logarithmic, ..ChartAxis::default() },
            curves: vec![ChartCurve { points, ..ChartCurve::default() }],
            ..Chart::default()
        }
    }

    #[test]
    fn nothing_to_draw_is_no_picture() {
        assert_eq!(chart_svg(&chart(Vec::new(), false)), "");
        assert_eq!(chart_svg(&chart(vec![[0.0, f64::NAN]], false)), "");
        assert_eq!(chart_svg(&chart(vec![[0.0, -1.0], [1.0, 0.0]], true)), "");
    }

    #[test]
    fn a_gap_breaks_the_line_and_a_constant_can_be_drawn() {
        let svg = chart_svg(&chart(vec![[0.0, 1.0], [1.0, 1.0], [2.0, f64::NAN], [3.0, 1.0]], false));
        let d = svg.split("class=\"curve").nth(1).unwrap();
        assert_eq!(d.matches('M').count(), 2, "{d}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn names_stand_beside_their_points_and_not_on_each_other() {
        let mut named = chart(Vec::new(), false);
        let label = |x: f64, name: &str| ChartCurve {
            name: name.to_owned(),
            points: vec![[x, 1.0]],
            style: CurveStyle::Named,
        };
        named.curves = vec![label(0.0, "<ols>"), label(0.1, "wls"), label(10.0, "huber")];
        let svg = chart_svg(&named);
        assert!(svg.contains(">&lt;ols&gt;</text>") && !svg.contains("<ols>"));
        let at = |text: &str| {
            let before = svg.split(&format!(">{text}</text>")).next().unwrap();
            let attribute =
                |name: &str| before.rsplit(&format!("{name}=\"")).next().unwrap().split('"').next().unwrap();
            (attribute(" y").parse::<f64>().unwrap(), attribute("text-anchor").to_owned())
        };
        assert!((at("&lt;ols&gt;").0 - at("wls").0).abs() >= 12.0);
        assert_eq!(at("huber").1, "end");
    }

    #[test]
    fn thinning_keeps_extremes() {
        let mut points: Vec<[f64; 2]> = (0..50_000).map(|k| [f64::from(k), 0.0]).collect();
        points[12_345][1] = 7.0;
        points[40_001][1] = -3.0;
        let thin = thinned(&points);
        assert!(thin.len() <= MOST_POINTS, "{}", thin.len());
        assert!(thin.contains(&[12_345.0, 7.0]) && thin.contains(&[40_001.0, -3.0]));
    }

    #[test]
    fn decades_are_marked_on_a_logarithmic_axis() {
        let scale = Scale { low: -0.2, high: 6.1, logarithmic: true };
        let texts: Vec<String> = scale.ticks(5.0).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["1", "10", "100", "1000", "10000", "100000", "1e6"]);
    }

    /// A place a line below another one may round to less than a line.
    #[test]
    fn names_of_points_that_lie_together_find_an_end() {
        let mut named = chart(Vec::new(), false);
        named.curves = (0..300)
            .map(|k| ChartCurve {
                name: "ordinary least squares".to_owned(),
                style: CurveStyle::Named,
                points: vec![[1.0, 0.1 + 1e-3 * f64::from(k % 17)]],
            })
            .collect();
        assert_eq!(chart_svg(&named).matches("class=\"label\"").count(), 300);
    }
}
