//! Groups of points of nearly the same temperature.

/// Indices by temperature level, coldest first; temperatures within `tolerance` of the mean of a level belong to it.
pub fn temperature_levels(temperatures: &[f64], tolerance: f64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..temperatures.len()).collect();
    order.sort_by(|a, b| temperatures[*a].total_cmp(&temperatures[*b]).then(a.cmp(b)));
    let mut levels: Vec<Vec<usize>> = Vec::new();
    for k in order {
        match levels.last_mut() {
            Some(level) if temperatures[k] - mean(temperatures, level) <= tolerance => level.push(k),
            _ => levels.push(vec![k]),
        }
    }
    levels
}

pub(super) fn mean(values: &[f64], indices: &[usize]) -> f64 {
    indices.iter().map(|k| values[*k]).sum::<f64>() / indices.len().max(1) as f64
}

/// Number of speeds that differ by more than 5 %.
pub(super) fn speed_levels(speeds: impl Iterator<Item = f64>) -> usize {
    let mut sorted: Vec<f64> = speeds.map(f64::abs).filter(|v| *v > 0.0).collect();
    sorted.sort_by(f64::total_cmp);
    let mut count = 0;
    let mut first = 0.0;
    for v in sorted {
        if count == 0 || v > 1.05 * first {
            (count, first) = (count + 1, v);
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_told_apart_and_drift_within_one_is_not() {
        let found = temperature_levels(&[30.4, 19.2, 29.8, 18.9, 51.0, 19.6], 2.5);
        assert_eq!(found, [vec![3, 1, 5], vec![2, 0], vec![4]]);
        assert_eq!(speed_levels([0.01, -0.0102, 0.02, 0.5, 0.51].into_iter()), 3);
    }
}
