//! A surface as a map: tinted cells, lines of equal value with their numbers, and where it was measured.

use super::axis::{tick_label, ticks};
use super::chart::Scale;
use super::ramp::colour;
use super::sheet::Sheet;
use crate::data::Surface;
use crate::markup::escape;

const WIDTH: f64 = 520.0;
const HEIGHT: f64 = 300.0;
const BAR: f64 = 12.0;

/// Empty unless the grid has two values each way and the values fit it.
pub(crate) fn surface_svg(data: &Surface) -> String {
    let (nx, ny) = (data.xs.len(), data.ys.len());
    let sound = data.values.len() == ny && data.values.iter().all(|row| row.len() == nx);
    let positive = |logarithmic: bool, list: &[f64]| !logarithmic || list.iter().all(|v| *v > 0.0);
    if nx < 2 || ny < 2 || !sound || !positive(data.x.logarithmic, &data.xs) {
        return String::new();
    }
    let all = data.values.iter().flatten().filter(|v| v.is_finite());
    let (low, high) = all.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    if low > high {
        return String::new();
    }
    let spread = if high > low { high - low } else { 1.0 };
    let share = |v: f64| (v - low) / spread;
    let x = Scale::new(&data.x, (scaled(&data.x, data.xs[0]), scaled(&data.x, data.xs[nx - 1])), 0.0);
    let y = Scale::new(&data.y, (scaled(&data.y, data.ys[0]), scaled(&data.y, data.ys[ny - 1])), 0.0);
    let sheet = Sheet { x, y, left: 48.0, right: WIDTH - 74.0, top: 8.0, floor: HEIGHT - 24.0 };
    let mut svg = format!(
        r#"<svg class="chart heat" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{}">"#,
        escape(&data.title)
    );
    cells(&mut svg, data, &sheet, &share);
    let wished = if high > low { ticks(low, high, 7.0) } else { Vec::new() };
    for level in &wished {
        contour(&mut svg, data, &sheet, *level);
    }
    for p in data.points.iter().filter(|p| p[0] >= data.xs[0] && p[0] <= data.xs[nx - 1]) {
        if p[1] >= data.ys[0] && p[1] <= data.ys[ny - 1] {
            svg.push_str(&format!(
                r#"<circle class="measured" cx="{:.1}" cy="{:.1}" r="1.5"/>"#,
                sheet.px(p[0]),
                sheet.py(p[1])
            ));
        }
    }
    sheet.axes(&mut svg, false);
    bar(&mut svg, &sheet, &share, &wished);
    svg.push_str("</svg>");
    svg
}

fn scaled(axis: &crate::data::ChartAxis, v: f64) -> f64 {
    if axis.logarithmic { v.log10() } else { v }
}

/// One rectangle per cell, tinted by the mean of its corners; neighbours overlap a little, so that no seams show.
fn cells(svg: &mut String, data: &Surface, sheet: &Sheet, share: &dyn Fn(f64) -> f64) {
    for (j, y) in data.ys.windows(2).enumerate() {
        for (i, x) in data.xs.windows(2).enumerate() {
            let v = &data.values;
            let mean = 0.25 * (v[j][i] + v[j][i + 1] + v[j + 1][i] + v[j + 1][i + 1]);
            if !mean.is_finite() {
                continue;
            }
            let (left, right) = (sheet.px(x[0]), sheet.px(x[1]));
            let (top, floor) = (sheet.py(y[1]), sheet.py(y[0]));
            svg.push_str(&format!(
                r#"<rect x="{left:.1}" y="{top:.1}" width="{:.1}" height="{:.1}" fill="{}"/>"#,
                (right - left + 0.4).min(sheet.right - left),
                (floor - top + 0.4).min(sheet.floor - top),
                colour(share(mean))
            ));
        }
    }
}

/// Line of equal value by marching over the triangles of the cells, its number where it is longest in sight.
fn contour(svg: &mut String, data: &Surface, sheet: &Sheet, level: f64) {
    let mut path = String::new();
    let mut middle: Option<([f64; 2], f64)> = None;
    let centre = [0.5 * (sheet.left + sheet.right), 0.5 * (sheet.top + sheet.floor)];
    for j in 0..data.ys.len() - 1 {
        for i in 0..data.xs.len() - 1 {
            let corner = |di: usize, dj: usize| {
                let place = [sheet.px(data.xs[i + di]), sheet.py(data.ys[j + dj])];
                (place, data.values[j + dj][i + di] - level)
            };
            let [a, b, c, d] = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
            for triangle in [[a, b, c], [a, c, d]] {
                let crossed: Vec<[f64; 2]> =
                    (0..3).filter_map(|k| crossing(triangle[k], triangle[(k + 1) % 3])).collect();
                let [from, to] = crossed[..] else { continue };
                path.push_str(&format!("M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1]));
                let at = [0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1])];
                let away = (at[1] - centre[1]).abs();
                let inside = at[0] > sheet.left + 22.0 && at[0] < sheet.right - 22.0;
                if inside && middle.is_none_or(|(_, least)| away < least) {
                    middle = Some((at, away));
                }
            }
        }
    }
    if path.is_empty() {
        return;
    }
    svg.push_str(&format!(r#"<path class="level" d="{path}"/>"#));
    if let Some(([x, y], _)) = middle {
        svg.push_str(&format!(
            r#"<text class="level" x="{x:.1}" y="{:.1}" text-anchor="middle">{}</text>"#,
            y + 3.5,
            tick_label(level)
        ));
    }
}

fn crossing((from, a): ([f64; 2], f64), (to, b): ([f64; 2], f64)) -> Option<[f64; 2]> {
    if !(a.is_finite() && b.is_finite()) || (a < 0.0) == (b < 0.0) {
        return None;
    }
    let share = a / (a - b);
    Some([from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])])
}

/// Scale of the tints.
fn bar(svg: &mut String, sheet: &Sheet, share: &dyn Fn(f64) -> f64, levels: &[f64]) {
    let left = sheet.right + 14.0;
    let height = sheet.floor - sheet.top;
    let steps = 40;
    for k in 0..steps {
        let from = f64::from(k) / f64::from(steps);
        svg.push_str(&format!(
            r#"<rect x="{left:.1}" y="{:.1}" width="{BAR}" height="{:.1}" fill="{}"/>"#,
            sheet.floor - (from + 1.0 / f64::from(steps)) * height,
            height / f64::from(steps) + if k > 0 { 0.4 } else { 0.0 },
            colour(from + 0.5 / f64::from(steps))
        ));
    }
    for level in levels {
        svg.push_str(&format!(
            r#"<text x="{:.1}" y="{:.1}">{}</text>"#,
            left + BAR + 5.0,
            sheet.floor - share(*level) * height + 3.5,
            tick_label(*level)
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane() -> Surface {
        Surface {
            xs: vec![0.0, 1.0, 2.0],
            ys: vec![0.0, 1.0, 2.0],
            values: (0..3).map(|j| (0..3).map(|i| f64::from(i) + 2.0 * f64::from(j)).collect()).collect(),
            points: vec![[1.0, 1.0], [9.0, 1.0]],
            ..Surface::default()
        }
    }

    #[test]
    fn a_plane_has_cells_levels_and_the_points_inside() {
        let svg = surface_svg(&plane());
        assert_eq!(svg.matches("class=\"measured\"").count(), 1);
        assert!(svg.matches("class=\"level\" d").count() >= 4, "{svg}");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }

    #[test]
    fn what_is_no_grid_is_no_picture() {
        assert_eq!(surface_svg(&Surface::default()), "");
        let mut torn = plane();
        torn.values[1].pop();
        assert_eq!(surface_svg(&torn), "");
        let mut empty = plane();
        empty.values.iter_mut().flatten().for_each(|v| *v = f64::NAN);
        assert_eq!(surface_svg(&empty), "");
    }
}
