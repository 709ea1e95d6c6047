//! Smoothing by polynomials.

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
