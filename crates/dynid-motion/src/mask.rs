//! Which samples and rows of a joint may be used.

use crate::signal::rms;

/// Velocity below which a joint counts as reversing: `max(stick_sigma sigma_v, level rms(v))`.
///
/// `sigma_v`: velocity noise after the state filter (see [`crate::spectrum::velocity_noise`]), same unit as
/// `velocity`; `stick_sigma` is 4 and `level` one of 0, 0.03, 0.06, 0.12, 0.25 in the usual ladder.
pub fn reversal_threshold(velocity: &[f64], sigma_v: f64, stick_sigma: f64, level: f64) -> f64 {
    threshold_at(rms(velocity), sigma_v, stick_sigma, level)
}

/// [`reversal_threshold`] of a velocity whose root mean square is known.
pub fn threshold_at(rms: f64, sigma_v: f64, stick_sigma: f64, level: f64) -> f64 {
    (stick_sigma * sigma_v).max(level * rms)
}

/// Samples with `|v| < threshold`, and both samples of every change of the sign of `v` (the sign of 0 is 0).
pub fn near_reversal(velocity: &[f64], threshold: f64) -> Vec<bool> {
    let mut bad: Vec<bool> = velocity.iter().map(|v| v.abs() < threshold).collect();
    for n in 1..velocity.len() {
        if sign(velocity[n - 1]) != sign(velocity[n]) {
            bad[n - 1] = true;
            bad[n] = true;
        }
    }
    bad
}

fn sign(v: f64) -> i8 {
    i8::from(v > 0.0) - i8::from(v < 0.0)
}

/// The first and the last `width` samples.
pub fn edges(samples: usize, width: usize) -> Vec<bool> {
    (0..samples).map(|n| n < width || n + width >= samples).collect()
}

/// Marks in `bad` what is marked in `more`. The lengths must agree.
pub fn merge(bad: &mut [bool], more: &[bool]) {
    assert_eq!(bad.len(), more.len(), "masks of one record");
    for (b, m) in bad.iter_mut().zip(more) {
        *b |= m;
    }
}

/// Samples within `half_width` of a marked one, in one pass over prefix counts.
pub fn dilate(bad: &[bool], half_width: usize) -> Vec<bool> {
    let n = bad.len();
    let mut marked_before = Vec::with_capacity(n + 1);
    marked_before.push(0usize);
    for (k, b) in bad.iter().enumerate() {
        marked_before.push(marked_before[k] + usize::from(*b));
    }
    (0..n)
        .map(|k| {
            let end = k.saturating_add(half_width).saturating_add(1).min(n);
            marked_before[end] > marked_before[k.saturating_sub(half_width)]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn dilation_marks_exactly_the_neighbours(
            bad in prop::collection::vec(any::<bool>(), 0..60), half in 0usize..70,
        ) {
            let wide = dilate(&bad, half);
            for (n, marked) in wide.iter().enumerate() {
                let expected = bad.iter().enumerate().any(|(k, b)| *b && n.abs_diff(k) <= half);
                prop_assert_eq!(*marked, expected);
            }
        }
    }

    #[test]
    fn a_sign_change_marks_both_sides() {
        assert_eq!(near_reversal(&[2.0, 1.0, -1.0, -2.0], 0.5), [false, true, true, false]);
        assert_eq!(near_reversal(&[2.0, 0.0, 2.0, 2.0], 0.0), [true, true, true, false]);
        assert_eq!(near_reversal(&[0.0; 3], 0.0), [false; 3]);
        assert_eq!(near_reversal(&[0.3, 2.0], 0.5), [true, false]);
    }

    #[test]
    fn thresholds_scale_with_noise_and_speed() {
        assert_eq!(reversal_threshold(&[1.0, -1.0], 0.01, 4.0, 0.0), 0.04);
        assert_eq!(reversal_threshold(&[1.0, -1.0], 0.01, 4.0, 0.25), 0.25);
        assert_eq!(reversal_threshold(&[], 0.0, 4.0, 0.25), 0.0);
    }
}
