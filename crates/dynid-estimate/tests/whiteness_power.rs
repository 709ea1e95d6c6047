//! In-band whiteness: how often white and coloured residuals of a filtered, decimated log are rejected.
#![expect(clippy::unwrap_used, reason = "in tests a panic is the report")]

use dynid_estimate::whiteness::{InBandSettings, correlation_length, in_band_whiteness, ljung_box};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::{PI, SQRT_2};

const RATE_HZ: f64 = 500.0;
const CUT_OFF_HZ: f64 = 10.0;
const DECIMATION: usize = 10;
const SECONDS: f64 = 30.0;
const RUNS: usize = 300;

/// Second-order Butterworth low pass by the bilinear transform: `b`, `a` with `a0 = 1`.
fn butterworth() -> ([f64; 3], [f64; 2]) {
    let c = 1.0 / (PI * CUT_OFF_HZ / RATE_HZ).tan();
    let g = 1.0 / (1.0 + SQRT_2 * c + c * c);
    ([g, 2.0 * g, g], [2.0 * g * (1.0 - c * c), g * (1.0 - SQRT_2 * c + c * c)])
}

fn gain(frequency: f64) -> f64 {
    let warped = (PI * frequency / RATE_HZ).tan() / (PI * CUT_OFF_HZ / RATE_HZ).tan();
    1.0 / (1.0 + warped.powi(4)).sqrt()
}

fn filter(signal: &mut [f64]) {
    let (b, a) = butterworth();
    let (mut s1, mut s2) = (0.0, 0.0);
    for v in signal {
        let x = *v;
        let y = b[0] * x + s1;
        s1 = b[1] * x - a[0] * y + s2;
        s2 = b[2] * x - a[1] * y;
        *v = y;
    }
}

/// Noise of correlation time `tau` seconds (0: white), filtered forth and back, decimated, edges cut.
fn residuals(rng: &mut ChaCha8Rng, tau: f64) -> Vec<f64> {
    let edge = RATE_HZ as usize;
    let pole = if tau > 0.0 { (-1.0 / (tau * RATE_HZ)).exp() } else { 0.0 };
    let mut state = 0.0;
    let mut signal: Vec<f64> = (0..(SECONDS * RATE_HZ) as usize + 2 * edge)
        .map(|_| {
            let draw: f64 = StandardNormal.sample(rng);
            state = pole * state + draw;
            state
        })
        .collect();
    filter(&mut signal);
    signal.reverse();
    filter(&mut signal);
    signal.reverse();
    signal[edge..signal.len() - edge].iter().step_by(DECIMATION).copied().collect()
}

fn rejections(tau: f64) -> f64 {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let rate = RATE_HZ / DECIMATION as f64;
    let rejected = (0..RUNS)
        .filter(|_| {
            in_band_whiteness(&residuals(&mut rng, tau), rate, CUT_OFF_HZ, gain, &InBandSettings::default())
                .unwrap()
                .rejected()
        })
        .count();
    rejected as f64 / RUNS as f64
}

#[test]
fn white_noise_is_seldom_rejected_and_colour_nearly_always() {
    let (null, power) = (rejections(0.0), rejections(0.05));
    println!("in-band whiteness: null {null}, power {power}");
    assert!(null <= 0.07, "null {null}");
    assert!(power >= 0.90, "power {power}");
}

#[test]
fn ljung_box_condemns_filtered_white_noise() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let filtered = residuals(&mut rng, 0.0);
    assert!(ljung_box(&filtered, 20).unwrap().p_value < 1e-6);
    let raw: Vec<f64> = (0..2000).map(|_| StandardNormal.sample(&mut rng)).collect();
    assert!(ljung_box(&raw, 20).unwrap().p_value > 1e-3);
}

#[test]
fn a_tone_is_named_and_silence_has_no_verdict() {
    let tone: Vec<f64> = (0..1500).map(|k| (2.0 * PI * 3.0 * f64::from(k) / 50.0).sin()).collect();
    let found = in_band_whiteness(&tone, 50.0, 10.0, gain, &InBandSettings::default()).unwrap();
    assert!(found.rejected() && (found.dominant_frequency - 3.0).abs() < 1e-9);
    assert_eq!(in_band_whiteness(&[0.0; 500], 50.0, 10.0, gain, &InBandSettings::default()), None);
    assert_eq!(ljung_box(&[0.0; 500], 20), None);
    assert_eq!(correlation_length(&[1.0; 50], 0.1, 10), None);
    // Autocorrelations -3/8, -2/8, 3/8, 0.
    let signs = [1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, -1.0];
    assert_eq!(correlation_length(&signs, 0.3, 4), Some(2));
    assert_eq!(correlation_length(&signs, 0.2, 4), Some(4));
}
