//! From the whole line onto [0, 1].

/// Half width of the curved stretch at each bound.
const MARGIN: f64 = 0.05;

/// `T(x)` in [0, 1].
pub(super) fn fold(x: f64) -> f64 {
    let width = 1.0 + 2.0 * MARGIN;
    let along = (x + MARGIN).rem_euclid(2.0 * width);
    let inner = if along > width { 2.0 * width - along } else { along } - MARGIN;
    if inner < MARGIN {
        (inner + MARGIN).powi(2) / (4.0 * MARGIN)
    } else if inner > 1.0 - MARGIN {
        1.0 - (inner - 1.0 - MARGIN).powi(2) / (4.0 * MARGIN)
    } else {
        inner
    }
}

/// The `x` nearest to 1/2 with `T(x) = share`, `share` in [0, 1].
pub(super) fn unfold(share: f64) -> f64 {
    let at_lower = |share: f64| 2.0 * (MARGIN * share).sqrt() - MARGIN;
    if share < MARGIN {
        at_lower(share)
    } else if share > 1.0 - MARGIN {
        1.0 - at_lower(1.0 - share)
    } else {
        share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folding_inverts_unfolding_and_stays_in_the_box() {
        for k in 0..=1000 {
            let share = k as f64 / 1000.0;
            assert!((fold(unfold(share)) - share).abs() < 1e-15, "{share}");
        }
        for k in -5000..5000 {
            let x = k as f64 / 1000.0;
            assert!((0.0..=1.0).contains(&fold(x)), "{x}");
            let slope = (fold(x + 1e-6) - fold(x - 1e-6)) / 2e-6;
            assert!(slope.abs() <= 1.0 + 1e-5, "slope {slope} at {x}: no jump anywhere");
        }
    }
}
