//! In-band whiteness: how often white and coloured residuals of a log are rejected.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::whiteness::{InBandSettings, counted_autocorrelation, raw_in_band_whiteness};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use std::f64::consts::PI;

const RATE_HZ: f64 = 500.0;
const CUT_OFF_HZ: f64 = 10.0;
const SECONDS: f64 = 30.0;
const RUNS: u64 = 400;

/// Noise of correlation time `tau` seconds (0: white) at the raw rate.
fn noise(rng: &mut ChaCha8Rng, tau: f64, samples: usize) -> Vec<f64> {
    let pole = if tau > 0.0 { (-1.0 / (tau * RATE_HZ)).exp() } else { 0.0 };
    let mut state = 0.0;
    (0..samples)
        .map(|_| {
            let draw: f64 = StandardNormal.sample(rng);
            state = pole * state + draw;
            state
        })
        .collect()
}

/// Stretches of `off` seconds after every `on` seconds, give or take half, set to zero.
fn blank(signal: &mut [f64], rng: &mut ChaCha8Rng, on: f64, off: f64) {
    let mut length = |mean: f64| ((0.5 + rng.random::<f64>()) * mean * RATE_HZ) as usize;
    let mut start = length(on);
    while start < signal.len() {
        let end = (start + length(off)).min(signal.len());
        signal[start..end].fill(0.0);
        start = end + length(on);
    }
}

/// Share of rejected raw residuals of which some stretches do not count.
fn raw_rejections(tau: f64, on: f64, off: f64) -> f64 {
    let rejected: usize = (0..RUNS)
        .into_par_iter()
        .map(|run| {
            let mut rng = ChaCha8Rng::seed_from_u64(12);
            rng.set_stream(run);
            let mut signal = noise(&mut rng, tau, (SECONDS * RATE_HZ) as usize);
            blank(&mut signal, &mut rng, on, off);
            let found = raw_in_band_whiteness(&signal, RATE_HZ, CUT_OFF_HZ, &InBandSettings::default());
            usize::from(found.unwrap().rejected())
        })
        .sum();
    rejected as f64 / RUNS as f64
}

#[test]
fn raw_residuals_are_judged_with_stretches_that_do_not_count() {
    // Whole; reversals of a tenth of a second; stand-stills of a second, half of the log.
    for (on, off) in [(1.0, 0.0), (0.4, 0.1), (1.0, 1.0), (2.0, 0.7)] {
        let (null, power) = (raw_rejections(0.0, on, off), raw_rejections(0.05, on, off));
        println!("raw in-band whiteness, {off} s of {} s out: null {null}, power {power}", on + off);
        assert!(null <= 0.07, "null {null} with {off} s of {}", on + off);
        assert!(power >= 0.90, "power {power} with {off} s of {}", on + off);
    }
}

#[test]
fn raw_residuals_without_enough_samples_have_no_verdict() {
    let settings = InBandSettings::default();
    assert_eq!(raw_in_band_whiteness(&[0.0; 5000], RATE_HZ, CUT_OFF_HZ, &settings), None);
    let mut short = vec![0.0; 5000];
    short.iter_mut().take(400).enumerate().for_each(|(k, v)| *v = (k as f64).sin());
    assert_eq!(raw_in_band_whiteness(&short, RATE_HZ, CUT_OFF_HZ, &settings), None);
    let tone: Vec<f64> = (0..5000).map(|k| 7.0 + (2.0 * PI * 3.0 * f64::from(k) / RATE_HZ).sin()).collect();
    let found = raw_in_band_whiteness(&tone, RATE_HZ, CUT_OFF_HZ, &settings).unwrap();
    assert!(found.rejected() && (found.dominant_frequency - 3.0).abs() < 1e-9, "an offset is no tone");
}

#[test]
fn autocorrelations_of_counted_samples_are_those_of_the_definition() {
    let signal = [1.0, -2.0, 0.0, 0.0, 3.0, 1.5, -1.0, 0.0, 2.0];
    let found = counted_autocorrelation(&signal, 5).unwrap();
    let energy = signal.iter().map(|v| v * v).sum::<f64>() / 6.0;
    for (lag, value) in (1..).zip(&found) {
        let pairs: Vec<f64> =
            (lag..9).map(|k| signal[k] * signal[k - lag]).filter(|product| *product != 0.0).collect();
        let expected = pairs.iter().sum::<f64>() / pairs.len() as f64 / energy;
        assert!((value - expected).abs() < 1e-14, "lag {lag}: {value} against {expected}");
    }
    assert_eq!(counted_autocorrelation(&[0.0; 9], 3), None);
    assert_eq!(counted_autocorrelation(&signal, 9), None);
    let gap = [1.0, 0.0, 0.0, 0.0, 1.0];
    assert_eq!(counted_autocorrelation(&gap, 3), Some(vec![0.0, 0.0, 0.0]));
}
