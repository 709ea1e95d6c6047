//! Smoothing by cubics over five samples.

use crate::signal::{SignalError, check_signal};

/// Weights over 35 of the least-squares cubic through five samples, at its middle, second and first sample.
const MIDDLE: [f64; 5] = [-3.0, 12.0, 17.0, 12.0, -3.0];
const SECOND: [f64; 5] = [2.0, 27.0, 12.0, -8.0, 2.0];
/// Over 70.
const FIRST: [f64; 5] = [69.0, 4.0, -6.0, 4.0, -1.0];

/// Five-point cubic smoothing: every sample becomes the value of the least-squares cubic through it and its two neighbours
/// on each side, `(-3 y₋₂ + 12 y₋₁ + 17 y₀ + 12 y₁ - 3 y₂) / 35`; the two samples at each end take their values from the
/// outermost cubic.
///
/// `passes`: how often, each time from the samples of the pass before; 0 changes nothing. Cubics pass unchanged. White
/// noise falls to `√(17/35)` = 0.70 of its RMS with one pass; many passes round off steps, such as Coulomb friction at a
/// reversal. The study of the ER-16 uses 3 passes at 100 Hz on torques.
///
/// # Errors
/// [`SignalError`] with fewer than five samples, or if one is not finite.
pub fn five_point_cubic(signal: &[f64], passes: usize) -> Result<Vec<f64>, SignalError> {
    check_signal(signal, 5)?;
    let mut smooth = signal.to_vec();
    for _ in 0..passes {
        smooth = pass(&smooth);
    }
    Ok(smooth)
}

/// Frequency at which the amplitude of so many passes of [`five_point_cubic`] falls to one half for the first time, in parts of the
/// sample rate; `None` without a pass.
pub fn five_point_half_amplitude(passes: usize) -> Option<f64> {
    half_amplitude(&MIDDLE.map(|w| w / 35.0), passes)
}

/// Steps over which the first crossing is looked for.
const STEPS: usize = 1 << 14;

/// Frequency at which the response of symmetric weights, to the power of `passes`, falls to one half, in parts of the sample rate.
pub(crate) fn half_amplitude(weights: &[f64], passes: usize) -> Option<f64> {
    let middle = (weights.len() / 2) as f64;
    let passes = i32::try_from(passes).unwrap_or(i32::MAX);
    let response = |f: f64| {
        let shifted = weights.iter().enumerate();
        let one =
            shifted.map(|(k, w)| w * (std::f64::consts::TAU * f * (k as f64 - middle)).cos()).sum::<f64>();
        one.powi(passes)
    };
    let at = |step: usize| 0.5 * step as f64 / STEPS as f64;
    // From an amplitude of 1 the first crossing lies far from the lobes, so that a coarse scan suffices to bracket it.
    let first = (1..=STEPS).find(|step| response(at(*step)) <= 0.5)?;
    let (mut low, mut high) = (at(first - 1), at(first));
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if response(middle) > 0.5 { low = middle } else { high = middle }
    }
    Some(0.5 * (low + high))
}

fn pass(y: &[f64]) -> Vec<f64> {
    let weighted =
        |weights: &[f64; 5], five: &[f64]| weights.iter().zip(five).map(|(w, y)| w * y).sum::<f64>();
    let mirrored = |weights: &[f64; 5], five: &[f64]| {
        weights.iter().zip(five.iter().rev()).map(|(w, y)| w * y).sum::<f64>()
    };
    let (head, tail) = (&y[..5], &y[y.len() - 5..]);
    let mut out = Vec::with_capacity(y.len());
    out.push(weighted(&FIRST, head) / 70.0);
    out.push(weighted(&SECOND, head) / 35.0);
    out.extend(y.windows(5).map(|five| weighted(&MIDDLE, five) / 35.0));
    out.push(mirrored(&SECOND, tail) / 35.0);
    out.push(mirrored(&FIRST, tail) / 70.0);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn passes_lower_the_half_amplitude() {
        // (17 + 24 cos w - 6 cos 2w)/35 = 1/2 with c = cos w: 12 c² - 24 c - 5.5 = 0.
        let c = (24.0 - (576.0_f64 + 264.0).sqrt()) / 24.0;
        let one = five_point_half_amplitude(1).unwrap();
        assert!((one - c.acos() / std::f64::consts::TAU).abs() < 1e-12);
        assert!(five_point_half_amplitude(3).unwrap() < one);
        assert_eq!(five_point_half_amplitude(0), None);
    }
}
