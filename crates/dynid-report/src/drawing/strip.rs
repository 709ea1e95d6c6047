//! Numbers as dots along an axis.

use super::axis::{tick_label, ticks};
use crate::number::significant;

const WIDTH: f64 = 560.0;
const LEFT: f64 = 14.0;
const RIGHT: f64 = 24.0;
const AXIS: f64 = 20.0;
const RADIUS: f64 = 4.0;

/// A dot.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StripDot {
    pub(crate) seed: u64,
    pub(crate) value: f64,
    pub(crate) best: bool,
}

/// Finite dots above an axis, stacked where they would overlap, with a band from the least up to `band`. Empty without a
/// finite dot.
pub(crate) fn strip_svg(label: &str, dots: &[StripDot], band: Option<f64>) -> String {
    let mut dots: Vec<StripDot> = dots.iter().copied().filter(|d| d.value.is_finite()).collect();
    dots.sort_by(|a, b| a.value.total_cmp(&b.value));
    let (Some(first), Some(last)) = (dots.first(), dots.last()) else { return String::new() };
    let band = band.filter(|b| b.is_finite() && *b >= first.value);
    let highest = band.map_or(last.value, |b| b.max(last.value));
    let spread = highest - first.value;
    let spread = if spread > 0.0 { spread } else { 0.1 * first.value.abs().max(1e-9) };
    let (low, high) = (first.value - 0.04 * spread, highest + 0.04 * spread);
    let x = |v: f64| LEFT + (v - low) / (high - low) * (WIDTH - LEFT - RIGHT);

    // Each dot lies on the lowest level whose last dot is far enough to the left.
    let mut ends: Vec<f64> = Vec::new();
    let places: Vec<usize> = dots
        .iter()
        .map(|d| {
            let free = ends.iter().position(|end| x(d.value) - end >= 2.0 * RADIUS + 0.5);
            let level = free.unwrap_or(ends.len());
            if free.is_none() {
                ends.push(0.0);
            }
            ends[level] = x(d.value);
            level
        })
        .collect();
    let floor = 8.0 + ends.len().max(2) as f64 * (2.0 * RADIUS + 0.5);
    let height = floor + AXIS;
    let mut svg =
        format!(r#"<svg class="strip" viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{label}">"#);
    if let Some(band) = band {
        svg.push_str(&format!(
            r#"<rect class="band" x="{:.1}" y="0" width="{:.1}" height="{floor}"/>"#,
            x(first.value),
            (x(band) - x(first.value)).max(1.0)
        ));
    }
    svg.push_str(&format!(r#"<path class="axis" d="M{LEFT} {floor}H{}"/>"#, WIDTH - RIGHT));
    for t in ticks(low, high, 6.0) {
        svg.push_str(&format!(
            r#"<path class="axis" d="M{0:.1} {floor}v4"/><text x="{0:.1}" y="{1}" text-anchor="middle">{2}</text>"#,
            x(t),
            height - 4.0,
            tick_label(t)
        ));
    }
    for (d, level) in dots.iter().zip(places) {
        svg.push_str(&format!(
            r#"<circle class="{}" cx="{:.1}" cy="{:.1}" r="{RADIUS}"><title>seed {}: {}</title></circle>"#,
            if d.best { "best" } else { "dot" },
            x(d.value),
            floor - RADIUS - 1.0 - level as f64 * (2.0 * RADIUS + 0.5),
            d.seed,
            significant(d.value, 4)
        ));
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dots(values: &[f64]) -> Vec<StripDot> {
        (0..).zip(values).map(|(seed, &value)| StripDot { seed, value, best: seed == 0 }).collect()
    }

    #[test]
    fn dots_that_would_overlap_are_stacked() {
        let svg = strip_svg("starts", &dots(&[1.0, 1.0, 2.0, f64::NAN]), Some(1.05));
        assert_eq!(svg.matches("<circle").count(), 3);
        assert_eq!(svg.matches(r#"cy="20.0""#).count(), 2);
        assert_eq!(svg.matches(r#"cy="11.5""#).count(), 1);
        assert!(svg.contains("<title>seed 2: 2.000</title>"));
    }

    #[test]
    fn one_dot_has_an_axis_and_none_has_no_picture() {
        let svg = strip_svg("starts", &dots(&[3.0]), None);
        assert!(svg.contains(r#"class="best""#) && !svg.contains("NaN"));
        assert_eq!(strip_svg("starts", &[], Some(1.0)), "");
    }
}
