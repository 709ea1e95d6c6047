//! The 95 % interval of a parameter, drawn in units of its own magnitude.

use crate::number::significant;

const WIDTH: f64 = 150.0;
const HEIGHT: f64 = 16.0;
/// Left and right end of the axis in units of `|value|`.
const AXIS: [f64; 2] = [-1.0, 3.0];

/// `value +- half_width` on an axis from `-|value|` to `3 |value|`, mirrored for negative values: the tick is zero,
/// the dot the estimate, and an interval that reaches the tick belongs to a parameter that may be zero.
///
/// One axis for all parameters would hide most of them, their units and magnitudes spanning many decades. Ends
/// beyond the axis are drawn as arrows. Empty unless both numbers are finite, `value != 0` and `half_width >= 0`.
pub(crate) fn interval_svg(value: f64, half_width: f64) -> String {
    if !(value.is_finite() && half_width.is_finite() && value != 0.0 && half_width >= 0.0) {
        return String::new();
    }
    let half = half_width / value.abs();
    let x = |u: f64| (u.clamp(AXIS[0], AXIS[1]) - AXIS[0]) / (AXIS[1] - AXIS[0]) * (WIDTH - 10.0) + 5.0;
    let (low, high, middle) = (x(1.0 - half), x(1.0 + half), HEIGHT / 2.0);
    let class = if half < 1.0 { "sure" } else { "unsure" };
    let mut svg = format!(
        concat!(
            r#"<svg class="interval {class}" viewBox="0 0 {width} {height}" role="img" aria-label="95 % interval {a} to {b}">"#,
            r#"<path class="grid" d="M5 {middle}H{right}"/><path class="zero" d="M{zero:.1} 2V14"/>"#,
            r#"<path class="bar" d="M{low:.1} {middle}H{high:.1}M{low:.1} 4.5V11.5M{high:.1} 4.5V11.5"/>"#,
            r#"<circle cx="{estimate:.1}" cy="{middle}" r="2.6"/>"#
        ),
        class = class,
        width = WIDTH,
        height = HEIGHT,
        a = significant(value - half_width, 4),
        b = significant(value + half_width, 4),
        middle = middle,
        right = WIDTH - 5.0,
        zero = x(0.0),
        low = low,
        high = high,
        estimate = x(1.0),
    );
    if 1.0 - half < AXIS[0] {
        svg.push_str(r#"<path class="arrow" d="M0 8l6-4v8z"/>"#);
    }
    if 1.0 + half > AXIS[1] {
        svg.push_str(&format!(r#"<path class="arrow" d="M{WIDTH} 8l-6-4v8z"/>"#));
    }
    svg.push_str("</svg>");
    svg
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_interval_that_excludes_zero_is_sure() {
        assert!(interval_svg(-2.0, 1.9).contains("interval sure"));
        assert!(interval_svg(-2.0, 2.1).contains("interval unsure"));
        assert!(interval_svg(1.0, 0.25).contains("95 % interval 0.7500 to 1.250"));
    }

    #[test]
    fn ends_beyond_the_axis_become_arrows() {
        assert_eq!(interval_svg(1.0, 0.4).matches("arrow").count(), 0);
        assert_eq!(interval_svg(1.0, 1e9).matches("arrow").count(), 2);
    }

    #[test]
    fn an_undefined_interval_is_not_drawn() {
        for (value, half_width) in [(0.0, 1.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (1.0, -1.0)] {
            assert_eq!(interval_svg(value, half_width), "");
        }
    }
}
