//! Median and running median.

/// Median of finite values; the mean of the two middle ones for an even number, `None` if there are none.
pub fn median(values: &[f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    let (below, upper, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    let upper = *upper;
    if values.len() % 2 == 1 {
        return Some(upper);
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some(lower + 0.5 * (upper - lower))
}

/// Running median over a centred window of `window` samples (odd; an even number counts as the next odd one).
///
/// At the ends the window keeps the samples that exist. The signal must be finite; `O(n * window)` moves.
pub fn running_median(signal: &[f64], window: usize) -> Vec<f64> {
    let half = window / 2;
    let n = signal.len();
    let mut sorted: Vec<f64> = Vec::with_capacity(2 * half + 1);
    for &x in &signal[..half.min(n)] {
        insert(&mut sorted, x);
    }
    (0..n)
        .map(|centre| {
            if let Some(&entering) = signal.get(centre + half) {
                insert(&mut sorted, entering);
            }
            if centre > half {
                remove(&mut sorted, signal[centre - half - 1]);
            }
            middle(&sorted)
        })
        .collect()
}

fn insert(sorted: &mut Vec<f64>, x: f64) {
    let place = sorted.partition_point(|y| y.total_cmp(&x).is_lt());
    sorted.insert(place, x);
}

fn remove(sorted: &mut Vec<f64>, x: f64) {
    let place = sorted.partition_point(|y| y.total_cmp(&x).is_lt());
    sorted.remove(place);
}

fn middle(sorted: &[f64]) -> f64 {
    let upper = sorted[sorted.len() / 2];
    if sorted.len() % 2 == 1 {
        return upper;
    }
    let lower = sorted[sorted.len() / 2 - 1];
    lower + 0.5 * (upper - lower)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn median_of_even_and_odd_numbers() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 8.0]), Some(3.0));
        assert_eq!(median(&[]), None);
    }

    proptest! {
        #[test]
        fn running_median_is_the_median_of_every_window(
            signal in prop::collection::vec(-5i32..5, 0..60), half in 0usize..9,
        ) {
            let signal: Vec<f64> = signal.into_iter().map(f64::from).collect();
            let running = running_median(&signal, 2 * half + 1);
            for (centre, found) in running.iter().enumerate() {
                let window = &signal[centre.saturating_sub(half)..(centre + half + 1).min(signal.len())];
                prop_assert_eq!(Some(*found), median(window));
            }
        }
    }
}
