//! Which samples and rows of a joint may be used.

use crate::signal::{SignalError, check_cutoff, check_finite, rms};

/// Velocity below which a joint counts as reversing: `max(stick_sigma sigma_v, level rms(v))`.
///
/// `sigma_v`: velocity noise after the state filter (see [`crate::spectrum::velocity_noise`]), same unit as
/// `velocity`; `stick_sigma` is 4 and `level` one of 0, 0.03, 0.06, 0.12, 0.25 in the usual ladder.
pub fn reversal_threshold(velocity: &[f64], sigma_v: f64, stick_sigma: f64, level: f64) -> f64 {
    (stick_sigma * sigma_v).max(level * rms(velocity))
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

/// Share of true entries; 0 for none at all.
pub fn share(mask: &[bool]) -> f64 {
    if mask.is_empty() {
        return 0.0;
    }
    mask.iter().filter(|m| **m).count() as f64 / mask.len() as f64
}

/// What lies between a row and the bad samples it must not touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RowMargins {
    /// Half width of the row's kernel, samples.
    pub kernel_half_width: usize,
    /// Cut-off of the state filter, Hz.
    pub state_cutoff_hz: f64,
    /// Sample rate, Hz.
    pub rate_hz: f64,
}

/// Per sample: whether a row of the joint may be centred there.
///
/// Refused are rows with a sample near reversal (see [`near_reversal`]; `None` switches this off) within
/// `kernel + 0.5 / fc`, and rows with an end of the record or an unusable clock sample within `kernel + 1 / fc`.
/// `usable` is one flag per sample, from [`crate::clock`]. Fails if the lengths differ, the velocity is not finite or
/// the cut-off is not below half the rate.
pub fn usable_rows(
    velocity: &[f64],
    threshold: Option<f64>,
    usable: &[bool],
    margins: &RowMargins,
) -> Result<Vec<bool>, SignalError> {
    check_finite(velocity)?;
    check_cutoff(margins.state_cutoff_hz, margins.rate_hz)?;
    let n = velocity.len();
    if usable.len() != n {
        return Err(SignalError::Length { what: "usable", expected: n, found: usable.len() });
    }
    let filter_reach = |parts: f64| (parts * margins.rate_hz / margins.state_cutoff_hz).ceil() as usize;
    let outer = margins.kernel_half_width.saturating_add(filter_reach(1.0));
    let gaps: Vec<bool> = usable.iter().map(|u| !u).collect();
    let mut bad = dilate(&gaps, outer);
    merge(&mut bad, &edges(n, outer));
    if let Some(threshold) = threshold {
        let inner = margins.kernel_half_width.saturating_add(filter_reach(0.5));
        merge(&mut bad, &dilate(&near_reversal(velocity, threshold), inner));
    }
    Ok(bad.into_iter().map(|b| !b).collect())
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

    #[test]
    fn rows_keep_their_distance() {
        let mut velocity = vec![1.0; 200];
        velocity[100..].fill(-1.0);
        let mut usable = vec![true; 200];
        usable[40] = false;
        let margins = RowMargins { kernel_half_width: 3, state_cutoff_hz: 20.0, rate_hz: 100.0 };
        let rows = usable_rows(&velocity, Some(0.1), &usable, &margins).unwrap();
        let good: Vec<usize> = (0..200).filter(|n| rows[*n]).collect();
        // Outer margin 3 + 5, inner 3 + 2.5 rounded up.
        let expected: Vec<usize> = (8..32).chain(49..93).chain(107..192).collect();
        assert_eq!(good, expected);
        let unmasked = usable_rows(&velocity, None, &usable, &margins).unwrap();
        assert!(unmasked[100]);
    }

    #[test]
    fn short_records_have_no_rows() {
        let margins = RowMargins { kernel_half_width: 3, state_cutoff_hz: 20.0, rate_hz: 100.0 };
        assert_eq!(usable_rows(&[1.0; 5], Some(0.0), &[true; 5], &margins).unwrap(), [false; 5]);
        assert!(usable_rows(&[], None, &[], &margins).unwrap().is_empty());
        assert!(usable_rows(&[1.0], None, &[], &margins).is_err());
    }
}
