//! Spreads that hold where residuals are correlated in time.

/// Values of all unknowns on the way: `β`, per joint `[c, b..]`, and what weights are made of.
#[derive(Debug, Clone)]
pub(super) struct State {
    pub beta: Vec<f64>,
    pub joints: Vec<Vec<f64>>,
    pub sums_rms: Vec<f64>,
    pub joints_rms: Vec<f64>,
}

/// Standard deviation of a sum of correlated contributions: Bartlett window (Newey & West 1987).
pub(super) fn long_run(contributions: &[f64], lag: usize) -> f64 {
    let product = |shift: usize| {
        contributions.iter().zip(contributions.get(shift..).unwrap_or_default()).map(|(a, b)| a * b).sum()
    };
    let mut variance: f64 = product(0);
    for shift in 1..=lag {
        let at_shift: f64 = product(shift);
        variance += 2.0 * (1.0 - shift as f64 / (lag + 1) as f64) * at_shift;
    }
    variance.max(0.0).sqrt()
}

/// Jackknife over blocks of time (Tukey 1958), about the fit of all rows' mean of refits: per coefficient of a joint.
pub(super) fn spread_of_blocks(refits: &[State], best: &State, joint: usize) -> Vec<f64> {
    let blocks = refits.len() as f64;
    (0..best.joints[joint].len())
        .map(|k| {
            let values = || refits.iter().map(|r| r.joints[joint][k]);
            let mean = values().sum::<f64>() / blocks;
            ((blocks - 1.0) / blocks * values().map(|v| (v - mean).powi(2)).sum::<f64>()).sqrt()
        })
        .collect()
}
