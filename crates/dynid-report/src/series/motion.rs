//! What the page's script gets for a designed trajectory.

use super::decimation::Decimation;
use super::encoding::encode_values;
use super::payload::{Curve, Panel, PlotPayload, PointBudget, payload};

/// A curve and its limits would leave the curve less than a fifth of the picture's height: such limits are not drawn.
const FARTHEST_LIMIT: f64 = 2.0;

/// One quantity of one joint.
#[derive(Debug)]
pub(crate) struct Quantity<'a> {
    pub(crate) joint: &'a str,
    pub(crate) name: &'static str,
    pub(crate) samples: &'a [f64],
    /// Lower and upper limit.
    pub(crate) limits: [Option<f64>; 2],
}

/// One panel per quantity, with all but `recorded_s` shaded. Every quantity has the length of `time_s`.
pub(crate) fn motion_payload<'a>(
    time_s: &[f64],
    recorded_s: Option<[f64; 2]>,
    quantities: &[Quantity<'a>],
) -> PlotPayload<'a> {
    let budget = PointBudget::share_smooth(quantities.len());
    let decimation = Decimation::new(time_s.len(), budget.per_series);
    let shaded = unrecorded(time_s, recorded_s);
    let panel = |quantity: &Quantity<'a>| Panel {
        name: quantity.joint,
        series: vec![Curve {
            name: quantity.name,
            kind: "predicted",
            values: encode_values(&decimation.values(quantity.samples)),
        }],
        shaded: shaded.clone(),
        limits: drawn_limits(quantity.samples, quantity.limits).into_iter().flatten().collect(),
    };
    payload(time_s, decimation, quantities.iter().map(panel).collect())
}

/// Limits near enough to the curve to be drawn with it.
pub(crate) fn drawn_limits(samples: &[f64], limits: [Option<f64>; 2]) -> [Option<f64>; 2] {
    let finite = || samples.iter().copied().filter(|v| v.is_finite());
    let low = finite().fold(f64::INFINITY, f64::min);
    let high = finite().fold(f64::NEG_INFINITY, f64::max);
    let reach = if high > low { FARTHEST_LIMIT * (high - low) } else { f64::INFINITY };
    limits.map(|limit| limit.filter(|v| v.is_finite() && *v >= low - reach && *v <= high + reach))
}

/// What lies before and behind the recorded part.
fn unrecorded(time_s: &[f64], recorded_s: Option<[f64; 2]>) -> Vec<[f64; 2]> {
    let (Some([start, end]), Some(first), Some(last)) = (recorded_s, time_s.first(), time_s.last()) else {
        return Vec::new();
    };
    [[*first, start.min(*last)], [end.max(*first), *last]].into_iter().filter(|[a, b]| b > a).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn approach_and_return_are_shaded() {
        let time = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(unrecorded(&time, Some([1.0, 3.5])), [[0.0, 1.0], [3.5, 4.0]]);
        assert_eq!(unrecorded(&time, Some([0.0, 4.0])), [[0.0; 2]; 0]);
        assert_eq!(unrecorded(&time, Some([9.0, 9.0])), [[0.0, 4.0]]);
        assert_eq!(unrecorded(&time, None), [[0.0; 2]; 0]);
    }

    #[test]
    fn limits_that_would_flatten_the_curve_are_left_out() {
        let samples = [-1.0, f64::NAN, 1.0];
        assert_eq!(drawn_limits(&samples, [Some(-5.0), Some(5.1)]), [Some(-5.0), None]);
        assert_eq!(drawn_limits(&samples, [None, Some(f64::INFINITY)]), [None, None]);
        assert_eq!(drawn_limits(&[2.0; 3], [Some(-100.0), Some(100.0)]), [Some(-100.0), Some(100.0)]);
    }
}
