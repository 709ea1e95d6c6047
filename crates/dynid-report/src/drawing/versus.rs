//! Two curves over time in a picture that is as wide as the page: curves stretch, numbers at the axes do not.

use super::axis::{tick_label, ticks};

/// Units of the picture across and down; it is stretched over its place.
const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 400.0;
/// A curve is drawn by the least and the greatest of so many stretches.
const STRETCHES: usize = 500;

/// The picture and its numbers.
#[derive(Debug, Default)]
pub(crate) struct Versus {
    /// Curves, empty if nothing is finite.
    pub(crate) svg: String,
    /// Places from the left, %, and their numbers.
    pub(crate) across: Vec<(f64, String)>,
    /// Places from the top, %, and their numbers.
    pub(crate) down: Vec<(f64, String)>,
}

/// Curves of equal length over a time that does not decrease, each with the class of its line, the last one on top.
pub(crate) fn versus(time_s: &[f64], curves: &[(&str, &[f64])]) -> Versus {
    let finite = || curves.iter().flat_map(|(_, values)| values.iter()).copied().filter(|v| v.is_finite());
    let (Some(first), Some(last)) = (time_s.first().copied(), time_s.last().copied()) else {
        return Versus::default();
    };
    let (low, high) = finite().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if !(low.is_finite() && high.is_finite() && last > first) {
        return Versus::default();
    }
    let spread = (high - low).max(1e-9 * low.abs().max(high.abs()).max(1e-9));
    let (low, high) = (low - 0.06 * spread, high + 0.06 * spread);
    let x = |t: f64| (t - first) / (last - first);
    let y = |v: f64| (high - v) / (high - low);
    let across: Vec<(f64, String)> =
        ticks(first, last, 6.0).into_iter().map(|t| (100.0 * x(t), tick_label(t))).collect();
    let down: Vec<(f64, String)> =
        ticks(low, high, 4.0).into_iter().map(|v| (100.0 * y(v), tick_label(v))).collect();
    let mut svg =
        format!(r#"<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" aria-hidden="true">"#);
    let grid = |places: &[(f64, String)], line: &dyn Fn(f64) -> String| -> String {
        places.iter().map(|(at, _)| line(*at)).collect()
    };
    let lines = grid(&across, &|at| format!("M{:.0} 0V{HEIGHT}", at / 100.0 * WIDTH))
        + &grid(&down, &|at| format!("M0 {:.0}H{WIDTH}", at / 100.0 * HEIGHT));
    svg.push_str(&format!(r#"<path class="grid" d="{lines}"/>"#));
    for (class, values) in curves {
        let points = thinned(time_s, values);
        let mut d = String::new();
        let mut pen = false;
        for (t, v) in points {
            if v.is_finite() {
                d.push_str(&format!(
                    "{}{:.0} {:.0}",
                    if pen { "L" } else { "M" },
                    WIDTH * x(t),
                    HEIGHT * y(v)
                ));
            }
            pen = v.is_finite();
        }
        svg.push_str(&format!(r#"<path class="{class}" d="{d}"/>"#));
    }
    svg.push_str("</svg>");
    Versus { svg, across, down }
}

/// Least and greatest of each stretch in the order in which they come; a stretch without finite values is a gap.
fn thinned(time_s: &[f64], values: &[f64]) -> Vec<(f64, f64)> {
    let samples = time_s.len().min(values.len());
    let point = |k: usize| (time_s[k], values[k]);
    let stretch = values.len().div_ceil(STRETCHES).max(1);
    if stretch <= 2 {
        return (0..samples).map(point).collect();
    }
    (0..samples)
        .step_by(stretch)
        .flat_map(|start| {
            let finite = || (start..(start + stretch).min(samples)).filter(|k| values[*k].is_finite());
            let by = |a: &usize, b: &usize| values[*a].total_cmp(&values[*b]);
            match (finite().min_by(by), finite().max_by(by)) {
                (Some(least), Some(most)) => [point(least.min(most)), point(least.max(most))],
                _ => [(time_s[start], f64::NAN); 2],
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extremes_stay_and_gaps_break_the_curve() {
        let time: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let mut values: Vec<f64> = time.iter().map(|t| t.sin()).collect();
        values[12_345] = 9.0;
        values[5000..5200].fill(f64::NAN);
        let thin = thinned(&time, &values);
        assert!(thin.len() <= 2 * STRETCHES && thin.iter().any(|(_, v)| *v == 9.0));
        let drawn = versus(&time, &[("measured", &values)]);
        assert_eq!(drawn.svg.split("class=\"measured\"").nth(1).unwrap().matches('M').count(), 2);
        assert!(drawn.across.iter().chain(&drawn.down).all(|(at, _)| (0.0..=100.0).contains(at)));
        assert!(drawn.down.iter().any(|(_, text)| text == "5"), "{:?}", drawn.down);
    }

    #[test]
    fn nothing_finite_is_no_picture() {
        assert!(versus(&[], &[("measured", &[])]).svg.is_empty());
        assert!(versus(&[0.0, 1.0], &[("measured", &[f64::NAN; 2])]).svg.is_empty());
        assert!(!versus(&[0.0, 1.0], &[("measured", &[2.0; 2])]).svg.contains("NaN"));
    }
}
