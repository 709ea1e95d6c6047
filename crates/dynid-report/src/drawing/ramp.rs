//! Colours from low to high, the same on light and dark pages.

/// Cold blue over green and amber to warm red, even steps in lightness kept moderate for black text and white pages alike.
const STOPS: [[f64; 3]; 5] = [
    [43.0, 88.0, 178.0],
    [38.0, 145.0, 170.0],
    [88.0, 166.0, 92.0],
    [222.0, 160.0, 42.0],
    [200.0, 60.0, 40.0],
];

/// `rgb(..)` of a share between 0 and 1.
pub(super) fn colour(share: f64) -> String {
    let share = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) };
    let place = share * (STOPS.len() - 1) as f64;
    let k = (place as usize).min(STOPS.len() - 2);
    let mix = |i: usize| STOPS[k][i] + (place - k as f64) * (STOPS[k + 1][i] - STOPS[k][i]);
    format!("rgb({:.0},{:.0},{:.0})", mix(0), mix(1), mix(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_and_what_lies_beyond() {
        assert_eq!(colour(0.0), "rgb(43,88,178)");
        assert_eq!(colour(1.0), "rgb(200,60,40)");
        assert_eq!(colour(7.0), colour(1.0));
        assert_eq!(colour(f64::NAN), "rgb(43,88,178)");
    }
}
