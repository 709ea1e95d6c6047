//! A loss over the number of parameters.

use super::axis::{tick_label, ticks};
use crate::number::significant;

const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 210.0;
const LEFT: f64 = 44.0;
const RIGHT: f64 = 10.0;
const TOP: f64 = 10.0;
const BOTTOM: f64 = 32.0;
/// Losses beyond this many times the scatter between the least loss and the whole model's are cut off.
const HEADROOM: f64 = 1.6;

/// A loss and its standard error at a number of parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PathPoint {
    pub parameters: u64,
    pub loss: f64,
    pub standard_error: f64,
}

/// What is drawn beside the curve.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct PathMarks {
    /// Model to mark.
    pub chosen: Option<u64>,
    /// A level drawn across the picture.
    pub level: Option<f64>,
}

/// Largest loss worth drawing. Models with very few parameters fit so badly that they would flatten all others.
pub(crate) fn ceiling(points: &[PathPoint]) -> Option<f64> {
    let least = points.iter().map(|p| p.loss).fold(f64::INFINITY, f64::min);
    let whole = points.iter().max_by_key(|p| p.parameters)?;
    let top = whole.loss + whole.standard_error;
    // A curve without a rise towards the whole model still gets some height.
    Some(least + HEADROOM * (top - least).max(0.15 * least.abs()))
}

/// Least number of parameters worth drawing: the one beyond which every smaller model lies above the ceiling.
pub(crate) fn fewest(points: &[PathPoint], ceiling: f64) -> Option<u64> {
    let inside = points.iter().filter(|p| p.loss <= ceiling).map(|p| p.parameters).min()?;
    // One more, so that the rise is seen.
    Some(points.iter().map(|p| p.parameters).filter(|n| *n < inside).max().unwrap_or(inside))
}

/// `points` from the whole model down, in a picture over `fewest..=most` parameters and up to `ceiling`; with a band of
/// one standard error where there is one. Empty if fewer than two points are finite and inside.
pub(crate) fn path_svg(
    label: &str,
    points: &[PathPoint],
    fewest: u64,
    ceiling: f64,
    marks: PathMarks,
) -> String {
    let points: Vec<PathPoint> =
        points.iter().filter(|p| p.loss.is_finite() && p.parameters >= fewest).copied().collect();
    let most = points.iter().map(|p| p.parameters).max().unwrap_or(0);
    let low = points.iter().map(|p| p.loss - p.standard_error).fold(f64::INFINITY, f64::min);
    if points.len() < 2 || most <= fewest || low >= ceiling || !ceiling.is_finite() {
        return String::new();
    }
    let scale = Scale { fewest, most, low: low - 0.06 * (ceiling - low), ceiling };
    let mut svg =
        format!(r#"<svg class="path" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{label}">"#);
    axes(&scale, &mut svg);
    if points.iter().any(|p| p.standard_error > 0.0) {
        let upper = points.iter().map(|p| scale.at(p, p.loss + p.standard_error));
        let lower = points.iter().rev().map(|p| scale.at(p, p.loss - p.standard_error));
        let outline: Vec<String> = upper.chain(lower).collect();
        svg.push_str(&format!(r#"<path class="band" d="M{}z"/>"#, outline.join("L")));
    }
    if let Some(level) = marks.level.filter(|v| (scale.low..ceiling).contains(v)) {
        svg.push_str(&format!(r#"<path class="level" d="M{LEFT} {:.1}H{END}"/>"#, scale.y(level)));
    }
    svg.push_str(&format!(r#"<path class="line" d="M{}"/>"#, line(&points, &scale).join("L")));
    for p in points.iter().take_while(|p| p.loss <= ceiling) {
        dot(p, marks.chosen == Some(p.parameters), &scale, &mut svg);
    }
    svg.push_str("</svg>");
    svg
}

/// Right end of the horizontal axis and lower end of the vertical one.
const END: f64 = WIDTH - RIGHT;
const FLOOR: f64 = HEIGHT - BOTTOM;

/// Ends of both axes.
struct Scale {
    fewest: u64,
    most: u64,
    low: f64,
    ceiling: f64,
}

impl Scale {
    fn x(&self, parameters: f64) -> f64 {
        LEFT + (parameters - self.fewest as f64) / (self.most - self.fewest) as f64 * (END - LEFT)
    }

    /// Losses beyond the ceiling lie on it.
    fn y(&self, loss: f64) -> f64 {
        FLOOR - (loss.min(self.ceiling) - self.low) / (self.ceiling - self.low) * (FLOOR - TOP)
    }

    fn at(&self, p: &PathPoint, loss: f64) -> String {
        format!("{:.1} {:.1}", self.x(p.parameters as f64), self.y(loss))
    }
}

fn axes(scale: &Scale, svg: &mut String) {
    for v in ticks(scale.low, scale.ceiling, 5.0) {
        let y = scale.y(v);
        svg.push_str(&format!(
            r#"<path class="grid" d="M{LEFT} {y:.1}H{END}"/><text x="{:.1}" y="{:.1}" text-anchor="end">{}</text>"#,
            LEFT - 5.0,
            y + 3.5,
            tick_label(v)
        ));
    }
    for n in ticks(scale.fewest as f64, scale.most as f64, 6.0).into_iter().filter(|n| n.fract() == 0.0) {
        svg.push_str(&format!(
            r#"<path class="axis" d="M{0:.1} {FLOOR}v4"/><text x="{0:.1}" y="{1}" text-anchor="middle">{n}</text>"#,
            scale.x(n),
            FLOOR + 15.0
        ));
    }
    svg.push_str(&format!(
        r#"<path class="axis" d="M{LEFT} {FLOOR}H{END}"/><text x="{END}" y="{}" text-anchor="end">number of parameters</text>"#,
        HEIGHT - 3.0
    ));
}

/// Corners of the curve. Beyond the ceiling it leaves the picture at the place where it crosses it.
fn line(points: &[PathPoint], scale: &Scale) -> Vec<String> {
    let mut corners: Vec<String> = Vec::new();
    for (k, p) in points.iter().enumerate() {
        if p.loss <= scale.ceiling {
            corners.push(scale.at(p, p.loss));
            continue;
        }
        if let Some(before) = k.checked_sub(1).map(|b| points[b]) {
            let share = (scale.ceiling - before.loss) / (p.loss - before.loss);
            let n = before.parameters as f64 - share * (before.parameters as f64 - p.parameters as f64);
            corners.push(format!("{:.1} {TOP}", scale.x(n)));
        }
        break;
    }
    corners
}

fn dot(p: &PathPoint, chosen: bool, scale: &Scale, svg: &mut String) {
    let (x, y) = (scale.x(p.parameters as f64), scale.y(p.loss));
    let (class, radius) = if chosen { ("chosen", 4.0) } else { ("dot", 1.7) };
    if chosen {
        svg.push_str(&format!(r#"<path class="drop" d="M{x:.1} {FLOOR}V{y:.1}"/>"#));
    }
    let spread = match p.standard_error > 0.0 {
        true => format!(" ± {}", significant(p.standard_error, 2)),
        false => String::new(),
    };
    svg.push_str(&format!(
        r#"<circle class="{class}" cx="{x:.1}" cy="{y:.1}" r="{radius}"><title>{} parameters: {}{spread}</title></circle>"#,
        p.parameters,
        significant(p.loss, 4)
    ));
    if chosen {
        let (anchor, shift) = if x > END - 60.0 { ("end", -5.0) } else { ("start", 5.0) };
        // Beside the line down to the axis, or above the dot where that line is short.
        let foot = if y > FLOOR - 24.0 { y - 8.0 } else { FLOOR - 5.0 };
        svg.push_str(&format!(
            r#"<text class="name" x="{:.1}" y="{foot:.1}" text-anchor="{anchor}">{}</text>"#,
            x + shift,
            p.parameters
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(losses: &[f64]) -> Vec<PathPoint> {
        let most = losses.len() as u64;
        (0..most)
            .zip(losses)
            .map(|(k, loss)| PathPoint { parameters: most - k, loss: *loss, standard_error: 0.1 })
            .collect()
    }

    #[test]
    fn hopeless_models_do_not_flatten_the_picture() {
        let points = path(&[1.6, 1.4, 1.3, 1.5, 80.0, 9000.0]);
        let top = ceiling(&points).unwrap();
        assert!((1.7..2.5).contains(&top), "{top}");
        assert_eq!(fewest(&points, top), Some(2));
        let svg = path_svg("loss", &points, 2, top, PathMarks { chosen: Some(3), level: Some(1.4) });
        assert_eq!(svg.matches("<circle").count(), 4);
        assert_eq!(svg.matches(r#"class="chosen""#).count(), 1);
        assert_eq!(svg.matches(r#"class="level""#).count(), 1);
        assert!(svg.contains("<title>3 parameters: 1.500 ± 0.10</title>"));
    }

    #[test]
    fn one_model_or_none_makes_no_picture() {
        for losses in [&[][..], &[1.0], &[f64::NAN, 1.0]] {
            let points = path(losses);
            let top = ceiling(&points).unwrap_or(1.0);
            assert_eq!(path_svg("loss", &points, 0, top, PathMarks::default()), "", "{losses:?}");
        }
        assert_eq!(fewest(&[], 1.0), None);
    }
}
