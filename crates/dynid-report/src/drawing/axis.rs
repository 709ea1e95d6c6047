//! Round numbers along an axis.

/// Round numbers between `low` and `high`, about `wished` of them.
pub(super) fn ticks(low: f64, high: f64, wished: f64) -> Vec<f64> {
    let raw = (high - low) / wished;
    let power = 10f64.powf(raw.log10().floor());
    let step = [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| raw <= m * power).unwrap_or(10.0) * power;
    let first = (low / step).ceil() as i64;
    (first..).map(|k| k as f64 * step).take_while(|v| *v <= high).collect()
}

pub(super) fn tick_label(value: f64) -> String {
    // Multiples of a round step carry rounding of their last bits.
    let rounded: f64 = format!("{value:.6e}").parse().unwrap_or(value);
    crate::number::shortest(rounded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        assert_eq!(ticks(12.0, 64.0, 6.0), [20.0, 30.0, 40.0, 50.0, 60.0]);
        assert_eq!(ticks(-0.3, 0.7, 5.0), [-0.2, 0.0, 0.2, 0.4, 0.6000000000000001]);
    }
}
