//! Histogram of a residual beside the normal law of the same mean and deviation.

use super::frame::{self, BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH};
use crate::number::significant;
use crate::series::ResidualSummary;

/// Points along the normal curve.
const CURVE_POINTS: usize = 60;

/// Bars and curve share one scale: the curve is `samples * bin width * density`.
pub(crate) fn histogram_svg(summary: &ResidualSummary) -> String {
    let histogram = &summary.histogram;
    let bins = histogram.counts.len() as f64;
    let (right, floor) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let normal_peak = 8.0 / bins / (std::f64::consts::TAU).sqrt() * summary.samples as f64;
    let tallest = histogram.counts.iter().fold(normal_peak, |tallest, &count| tallest.max(count as f64));
    let y = |count: f64| floor - count / tallest * (floor - TOP);
    let bar = (right - LEFT) / bins;

    let mut svg = frame::open("Histogram of the residual");
    svg.push_str(r#"<path class="bars" d=""#);
    for (i, &count) in histogram.counts.iter().enumerate().filter(|(_, count)| **count > 0) {
        svg.push_str(&format!(
            "M{:.1} {floor:.1}V{:.1}h{:.1}V{floor:.1}z",
            LEFT + i as f64 * bar,
            y(count as f64),
            bar - 0.6
        ));
    }
    svg.push_str(r#""/>"#);
    if summary.std > 0.0 && summary.std.is_finite() {
        svg.push_str(r#"<path class="normal" d=""#);
        for i in 0..=CURVE_POINTS {
            let share = i as f64 / CURVE_POINTS as f64;
            let z = ((2.0 * share - 1.0) * histogram.half_width - summary.mean) / summary.std;
            let x = LEFT + share * (right - LEFT);
            let letter = if i == 0 { 'M' } else { 'L' };
            svg.push_str(&format!("{letter}{x:.1} {:.1}", y(normal_peak * (-0.5 * z * z).exp())));
        }
        svg.push_str(r#""/>"#);
    }
    svg.push_str(&frame::rule(floor, "axis"));
    let middle = (LEFT + right) / 2.0;
    for (x, value) in [(LEFT, -histogram.half_width), (middle, 0.0), (right, histogram.half_width)] {
        svg.push_str(&format!(r#"<path class="axis" d="M{x:.1} {floor:.1}v3"/>"#));
        svg.push_str(&frame::x_label(x, &significant(value, 2)));
    }
    svg.push_str("</svg>");
    svg
}
