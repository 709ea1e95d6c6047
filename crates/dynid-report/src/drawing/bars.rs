//! Bars: counts side by side, a share of a whole, two numbers to compare.

const HEIGHT: f64 = 12.0;
const WIDTH: f64 = 100.0;

/// Counts as one bar cut into pieces, the classes telling them apart; a count of zero takes no room. Stretches to the
/// width it is given.
pub(crate) fn counts_svg(label: &str, counts: &[(&str, usize)]) -> String {
    let total: usize = counts.iter().map(|(_, count)| count).sum();
    let mut svg = format!(
        r#"<svg class="counts" viewBox="0 0 1000 {HEIGHT}" preserveAspectRatio="none" role="img" aria-label="{label}">"#
    );
    let mut before = 0;
    for (class, count) in counts.iter().filter(|(_, count)| *count > 0) {
        let x = |n: usize| 1000.0 * n as f64 / total as f64;
        let width = (x(*count) - 2.0).max(1.0);
        svg.push_str(&format!(
            r#"<rect class="{class}" x="{:.1}" width="{width:.1}" height="{HEIGHT}"/>"#,
            x(before)
        ));
        before += count;
    }
    svg.push_str("</svg>");
    svg
}

/// `value` on an axis from 0 to `full` (longer bars end there) with a tick at `mark`. Empty unless `value` and `full`
/// are finite and `full > 0`.
pub(crate) fn meter_svg(value: f64, full: f64, mark: Option<f64>) -> String {
    if !(value.is_finite() && full.is_finite() && full > 0.0) {
        return String::new();
    }
    let x = |v: f64| WIDTH * (v / full).clamp(0.0, 1.0);
    let mut svg = format!(
        r#"<svg class="meter" viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true"><rect class="track" y="3" width="{WIDTH}" height="6"/><rect class="fill" y="3" width="{:.1}" height="6"/>"#,
        x(value)
    );
    if let Some(mark) = mark.filter(|m| m.is_finite()) {
        svg.push_str(&format!(
            r#"<path class="mark" d="M{:.1} 0V{HEIGHT}"/>"#,
            x(mark).clamp(0.8, WIDTH - 0.8)
        ));
    }
    svg.push_str("</svg>");
    svg
}

/// Two numbers of one kind as bars, one above the other, the longer one filling the width. Empty unless both are finite,
/// none is negative and one is not zero.
pub(crate) fn pair_svg(upper: f64, lower: f64) -> String {
    let full = upper.max(lower);
    if !(upper >= 0.0 && lower >= 0.0 && full > 0.0 && full.is_finite()) {
        return String::new();
    }
    format!(
        r#"<svg class="pairbar" viewBox="0 0 {WIDTH} {HEIGHT}" aria-hidden="true"><rect class="upper" y="0.5" width="{:.1}" height="5"/><rect class="lower" y="6.5" width="{:.1}" height="5"/></svg>"#,
        WIDTH * upper / full,
        WIDTH * lower / full
    )
}

/// A value with its error on an axis from 0 to `most`, stretched to the width it is given. Empty unless value and `most` are
/// finite and `most > 0`.
pub(crate) fn ranked_svg(value: f64, error: f64, most: f64) -> String {
    if !(value.is_finite() && most.is_finite() && most > 0.0) {
        return String::new();
    }
    let x = |v: f64| WIDTH * (v / most).clamp(0.0, 1.0);
    let error = if error.is_finite() { error.max(0.0) } else { 0.0 };
    format!(
        r#"<svg class="ranked" viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" aria-hidden="true"><rect class="track" y="5.5" width="{WIDTH}" height="1"/><rect class="fill" y="2.5" width="{:.1}" height="7"/><path class="error" d="M{:.1} 6H{:.1}"/></svg>"#,
        x(value),
        x(value - error),
        x(value + error)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_of_a_bar_are_as_long_as_their_counts() {
        let svg = counts_svg("parts", &[("a", 1), ("none", 0), ("b", 3)]);
        assert!(svg.contains(r#"class="a" x="0.0" width="248.0""#));
        assert!(svg.contains(r#"class="b" x="250.0" width="748.0""#));
        assert!(!svg.contains("none\" x"));
        assert_eq!(counts_svg("parts", &[("a", 0)]).matches("<rect").count(), 0);
    }

    #[test]
    fn a_meter_ends_at_its_full_length() {
        assert!(meter_svg(0.25, 1.0, None).contains(r#"width="25.0" height="6""#));
        assert!(meter_svg(7.0, 5.0, Some(1.0)).contains(r#"width="100.0" height="6""#));
        assert!(meter_svg(7.0, 5.0, Some(1.0)).contains("M20.0 0"));
        assert_eq!(meter_svg(f64::NAN, 1.0, None), "");
    }

    #[test]
    fn a_ranked_value_shows_its_error_and_stays_inside() {
        let svg = ranked_svg(2.0, 1.0, 4.0);
        assert!(svg.contains(r#"width="50.0" height="7""#) && svg.contains("M25.0 6H75.0"), "{svg}");
        assert!(ranked_svg(9.0, 1.0, 4.0).contains("H100.0"));
        assert!(ranked_svg(f64::NAN, 0.0, 1.0).is_empty() && ranked_svg(1.0, 0.0, 0.0).is_empty());
    }

    #[test]
    fn the_longer_of_two_bars_fills_the_width() {
        let svg = pair_svg(1.0, 4.0);
        assert!(svg.contains(r#"width="25.0" height="5""#) && svg.contains(r#"width="100.0" height="5""#));
        for (upper, lower) in [(0.0, 0.0), (f64::NAN, 1.0), (1.0, f64::INFINITY), (-1.0, 1.0)] {
            assert_eq!(pair_svg(upper, lower), "");
        }
    }
}
