//! Autocorrelation of a residual with the band of white noise.

use super::frame::{self, BOTTOM, HEIGHT, LEFT, RIGHT, TOP, WIDTH};
use crate::number::significant;
use crate::series::Autocorrelation;

/// Vertical range, from anticorrelated to identical.
const LEAST: f64 = -0.5;

/// `step_s`: sampling period, s.
pub(crate) fn autocorrelation_svg(autocorrelation: &Autocorrelation, step_s: f64) -> String {
    let (right, floor) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let y = |r: f64| floor - (r.clamp(LEAST, 1.0) - LEAST) / (1.0 - LEAST) * (floor - TOP);
    let lags = autocorrelation.values.len();
    let x = |lag: usize| LEFT + lag as f64 / lags.max(1) as f64 * (right - LEFT);
    let band = autocorrelation.white_band.min(0.5);

    let mut svg = frame::open("Autocorrelation of the residual");
    svg.push_str(&format!(
        r#"<rect class="band" x="{LEFT:.1}" y="{:.1}" width="{:.1}" height="{:.1}"/>"#,
        y(band),
        right - LEFT,
        (y(-band) - y(band)).max(1.0)
    ));
    for (r, text) in [(1.0, "1"), (0.5, "0.5"), (0.0, "0"), (-0.5, "-0.5")] {
        svg.push_str(&frame::rule(y(r), if r == 0.0 { "axis" } else { "grid" }));
        svg.push_str(&frame::y_label(y(r), text));
    }
    svg.push_str(&format!(r#"<path class="stems" d="M{:.1} {:.1}V{:.1}"#, x(0), y(0.0), y(1.0)));
    for (i, &r) in autocorrelation.values.iter().enumerate() {
        svg.push_str(&format!("M{:.1} {:.1}V{:.1}", x(i + 1), y(0.0), y(r)));
    }
    svg.push_str(r#""/>"#);
    let longest = (lags * autocorrelation.stride) as f64 * step_s;
    for (position, value) in [(x(0), 0.0), ((x(0) + right) / 2.0, longest / 2.0), (right, longest)] {
        let text = if value == 0.0 { "0".to_owned() } else { format!("{} s", significant(value, 2)) };
        svg.push_str(&frame::x_label(position, &text));
    }
    svg.push_str("</svg>");
    svg
}
