//! Curves and points coloured by temperature, each curve named at its end.

use super::chart::Scale;
use super::ramp::colour;
use super::sheet::Sheet;
use crate::data::CurvesByTemperature;
use crate::markup::escape;
use crate::number::significant;

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 300.0;
/// Least distance between names at the right end.
const LINE: f64 = 13.0;

/// Empty if nothing can be drawn.
pub(crate) fn by_temperature_svg(data: &CurvesByTemperature) -> String {
    let all = || {
        data.levels.iter().flat_map(|l| l.curve.iter().copied().chain(l.points.iter().map(|p| [p[0], p[1]])))
    };
    let x = |p: &[f64; 2]| !data.x.logarithmic || p[0] > 0.0;
    let finite = || all().filter(|p| p[0].is_finite() && p[1].is_finite()).filter(x);
    if finite().next().is_none() {
        return String::new();
    }
    let log = |v: f64, logarithmic: bool| if logarithmic { v.log10() } else { v };
    let extent = |k: usize, logarithmic: bool| {
        finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), p| {
            let v = log(p[k], logarithmic);
            (a.min(v), b.max(v))
        })
    };
    let (low, high) = extent(1, false);
    let sheet = Sheet {
        x: Scale::new(&data.x, extent(0, data.x.logarithmic), 0.01),
        // Friction is judged against zero.
        y: Scale::new(&data.y, (low.min(0.0), high), 0.03),
        left: 48.0,
        right: WIDTH - 62.0,
        top: 8.0,
        floor: HEIGHT - 24.0,
    };
    let mut svg = format!(
        r#"<svg class="chart heat" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{}">"#,
        escape(&data.title)
    );
    sheet.axes(&mut svg, true);
    let warm = || data.levels.iter().filter_map(|l| l.temperature);
    let (cold, hot) = warm().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)));
    let mut names = Vec::new();
    for level in &data.levels {
        let share =
            level.temperature.map_or(0.0, |t| if hot > cold { (t - cold) / (hot - cold) } else { 0.0 });
        let tint = colour(share);
        let mut path = String::new();
        for p in level.curve.iter().filter(|p| p[0].is_finite() && p[1].is_finite() && x(p)) {
            let pen = if path.is_empty() { 'M' } else { 'L' };
            path.push_str(&format!("{pen}{:.1} {:.1}", sheet.px(p[0]), sheet.py(p[1])));
        }
        svg.push_str(&format!(r#"<path class="curve" style="stroke:{tint}" d="{path}"/>"#));
        for [px, py, std] in
            level.points.iter().filter(|p| p.iter().all(|v| v.is_finite()) && x(&[p[0], p[1]]))
        {
            let (at, low, high) = (sheet.px(*px), sheet.py(py - std), sheet.py(py + std));
            svg.push_str(&format!(
                r#"<path class="curve" style="stroke:{tint}" d="M{at:.1} {low:.1}V{high:.1}"/><circle style="fill:{tint}" cx="{at:.1}" cy="{:.1}" r="2.1"/>"#,
                sheet.py(*py)
            ));
        }
        if let (Some(t), Some(end)) = (level.temperature, level.curve.last()) {
            names.push((sheet.py(end[1]), t, tint));
        }
    }
    names.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut least = f64::NEG_INFINITY;
    for (y, t, tint) in names {
        let at = y.max(least + LINE);
        least = at;
        svg.push_str(&format!(
            r#"<text style="fill:{tint}" x="{:.1}" y="{:.1}">{} °C</text>"#,
            sheet.right + 6.0,
            at + 3.5,
            significant(t, 3)
        ));
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::TemperatureLevel;

    #[test]
    fn nothing_is_no_picture_and_names_do_not_overlap() {
        assert_eq!(by_temperature_svg(&CurvesByTemperature::default()), "");
        let level = |t: f64| TemperatureLevel {
            temperature: Some(t),
            curve: vec![[0.1, 1.0], [1.0, 2.0 + 1e-3 * t]],
            points: vec![[0.5, 1.5, 0.1]],
        };
        let data = CurvesByTemperature { levels: vec![level(20.0), level(30.0)], ..Default::default() };
        let svg = by_temperature_svg(&data);
        let heights: Vec<f64> = svg
            .split("<text style")
            .skip(1)
            .map(|t| t.split(" y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap())
            .collect();
        assert!(heights.len() == 2 && (heights[1] - heights[0]).abs() >= LINE - 0.11, "{heights:?}");
    }
}
