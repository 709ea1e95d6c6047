//! Noise and band of signals whose noise is known.

use dynid_motion::signal::rms;
use dynid_motion::spectrum::{NoiseSettings, effort_noise, excited_band, noise_limit, position_noise, welch};

const RATE: f64 = 500.0;

/// Sum of twelve uniform numbers: standard deviation 1.
fn white(samples: usize, seed: u64) -> Vec<f64> {
    let mut state = seed;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..samples).map(|_| (0..12).map(|_| uniform() - 0.5).sum()).collect()
}

fn sine(samples: usize, hz: f64) -> Vec<f64> {
    (0..samples).map(|n| (std::f64::consts::TAU * hz * n as f64 / RATE).sin()).collect()
}

#[test]
fn white_noise_on_a_sine_is_measured() {
    let sd = 3e-5;
    let noise: Vec<f64> = white(20_000, 7).iter().map(|x| sd * x).collect();
    let position: Vec<f64> = sine(20_000, 0.5).iter().zip(&noise).map(|(s, n)| s + n).collect();
    let found = position_noise(&position, RATE, &NoiseSettings::default()).unwrap();
    // The median of some 500 correlated bins, each the mean of about 9 independent segments, has a relative standard
    // deviation of 1.25 / sqrt(9 * 500 / 1.5) = 2.3 % in power: three of them are 4 % in amplitude.
    assert!((found.sigma / rms(&noise) - 1.0).abs() < 0.04, "{}", found.sigma / rms(&noise));
    assert!((0.4..0.7).contains(&found.excited_band_hz), "{}", found.excited_band_hz);
    // Acceleration of sin(w t): variance w^4 / 2.
    let expected = std::f64::consts::PI.powi(4) / 2.0;
    assert!((found.acceleration_variance / expected - 1.0).abs() < 0.02);
    let limit = noise_limit(found.acceleration_variance, found.floor_psd, 5e-5);
    assert!((limit - found.noise_limit_hz).abs() < 1e-12 * limit);
    let effort = effort_noise(&position, RATE, &NoiseSettings::default()).unwrap();
    assert!((effort.sigma / rms(&noise) - 1.0).abs() < 0.04);
}

#[test]
fn at_the_limit_the_noise_has_the_tolerated_share() {
    let (variance, floor) = (7.0, 2e-12);
    let limit = noise_limit(variance, floor, 5e-5);
    // Noise power of the acceleration below f: S_n (2 pi)^4 f^5 / 5.
    let power = floor * std::f64::consts::TAU.powi(4) * limit.powi(5) / 5.0;
    assert!((power / variance / 5e-5 - 1.0).abs() < 1e-12);
    assert_eq!(noise_limit(0.0, 0.0, 5e-5), 0.0);
    assert_eq!(noise_limit(1.0, 0.0, 5e-5), f64::INFINITY);
}

/// Coloured noise far above the floor must not pass for acceleration.
#[test]
fn noise_above_the_floor_does_not_lift_the_limit() {
    let sd = 3e-5;
    let clean: Vec<f64> = sine(20_000, 0.5).iter().zip(white(20_000, 7)).map(|(s, n)| s + sd * n).collect();
    let jitter = white(20_002, 8_675_309);
    let coloured: Vec<f64> = clean
        .iter()
        .enumerate()
        .map(|(n, x)| x + 4.0 * sd * (jitter[n] + 2.0 * jitter[n + 1] + jitter[n + 2]))
        .collect();
    let limit = |x: &[f64]| position_noise(x, RATE, &NoiseSettings::default()).unwrap().noise_limit_hz;
    assert!(limit(&coloured) <= 1.01 * limit(&clean), "{} {}", limit(&coloured), limit(&clean));
}

#[test]
fn degenerate_positions_have_defined_noise() {
    let line: Vec<f64> = (0..300).map(|n| 0.25 * f64::from(n)).collect();
    for position in [vec![0.0; 300], vec![1.7; 300], line] {
        let found = position_noise(&position, RATE, &NoiseSettings::default()).unwrap();
        assert_eq!((found.floor_psd, found.crossing_hz), (0.0, None));
        assert_eq!((found.noise_limit_hz, found.acceleration_variance), (0.0, 0.0));
        assert!(found.excited_band_hz.is_finite());
    }
    assert_eq!(excited_band(&[0.1; 100], RATE, 0.999).unwrap(), 0.0);
    assert_eq!(effort_noise(&[2.0; 40], RATE, &NoiseSettings::default()).unwrap().sigma, 0.0);
    assert!(position_noise(&[0.0; 15], RATE, &NoiseSettings::default()).is_err());
    assert!(position_noise(&[f64::NAN; 50], RATE, &NoiseSettings::default()).is_err());
    assert!(welch(&[1.0, 2.0], RATE, 1).is_err());
    assert!(welch(&[1.0, 2.0], 0.0, 2).is_err());
}
