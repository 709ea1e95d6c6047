//! Signals of periodic motions: smoothing, derivatives by harmonics, averages over periods.

#![expect(clippy::unwrap_used, reason = "helpers of tests outside of test functions")]

use std::f64::consts::TAU;

use dynid_motion::SignalError;
use dynid_motion::frequency::{HarmonicPath, differentiate};
use dynid_motion::periods::average_periods;
use dynid_motion::smoothing::five_point_cubic;
use dynid_testing::golden;
use serde_json::Value;

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[track_caller]
fn check_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    for (n, (f, e)) in found.iter().zip(expected).enumerate() {
        assert!((f - e).abs() <= tolerance, "sample {n}: {f} against {e}");
    }
}

#[test]
fn smoothing_gives_the_reference_numbers() {
    let Some(g) = golden("er16_smoothing.json") else { return };
    let (input, tolerance) = (numbers(&g["input"]), g["tolerance_abs"].as_f64().unwrap());
    check_close(&five_point_cubic(&input, 1).unwrap(), &numbers(&g["pass1"]), tolerance);
    check_close(&five_point_cubic(&input, 3).unwrap(), &numbers(&g["pass3"]), tolerance);
    assert_eq!(five_point_cubic(&input, 0).unwrap(), input);
    let cubic = five_point_cubic(&numbers(&g["cubic_input"]), 1).unwrap();
    check_close(&cubic, &numbers(&g["cubic_output"]), tolerance);
}

#[test]
fn cubics_pass_smoothing_and_short_signals_are_told() {
    let cubic: Vec<f64> = (0..9).map(f64::from).map(|n| 2.0 - n + 0.3 * n * n - 0.02 * n.powi(3)).collect();
    check_close(&five_point_cubic(&cubic, 7).unwrap(), &cubic, 1e-12);
    let five = five_point_cubic(&cubic[..5], 1).unwrap();
    check_close(&five, &cubic[..5], 1e-13);
    let short = five_point_cubic(&cubic[..4], 1);
    assert_eq!(short, Err(SignalError::TooShort { expected: 5, found: 4 }));
    assert!(five_point_cubic(&[0.0, 1.0, f64::NAN, 0.0, 0.0], 1).is_err());
}

#[test]
fn derivatives_by_harmonics_give_the_reference_numbers() {
    let Some(g) = golden("er16_freqdiff.json") else { return };
    let input = numbers(&g["input"]);
    let (period, rate) = (g["period"].as_f64().unwrap(), 1.0 / g["sample_time"].as_f64().unwrap());
    let tolerance = g["tolerance_abs"].as_f64().unwrap();
    let found = differentiate(&input, rate, period, 5).unwrap();
    assert_eq!(found.path, HarmonicPath::Transform);
    for (found, key) in
        [(&found.position, "position"), (&found.velocity, "velocity"), (&found.acceleration, "acceleration")]
    {
        check_close(found, &numbers(&g[key]), tolerance);
    }
}

/// A series of three harmonics of 1.7 s with its derivatives, sampled at 40 Hz: 68 samples a period.
fn series(samples: usize) -> [Vec<f64>; 3] {
    let omega = TAU / 1.7;
    let mut out = [vec![0.4; samples], vec![0.0; samples], vec![0.0; samples]];
    for (k, (a, b)) in [(1.0, 0.3), (-0.2, 0.5), (0.05, -0.1)].into_iter().enumerate() {
        let w = omega * (k + 1) as f64;
        let [q, dq, ddq] = &mut out;
        for (n, ((q, dq), ddq)) in q.iter_mut().zip(dq).zip(ddq).enumerate() {
            let (sin, cos) = (w * n as f64 / 40.0).sin_cos();
            *q += a * sin + b * cos;
            *dq += w * (a * cos - b * sin);
            *ddq -= w * w * (a * sin + b * cos);
        }
    }
    out
}

#[test]
fn both_paths_differentiate_exactly() {
    for (samples, path) in
        [(68, HarmonicPath::Transform), (204, HarmonicPath::Transform), (151, HarmonicPath::LeastSquares)]
    {
        let [q, dq, ddq] = series(samples);
        let found = differentiate(&q, 40.0, 1.7, 5).unwrap();
        assert_eq!(found.path, path);
        check_close(&found.position, &q, 1e-12);
        check_close(&found.velocity, &dq, 1e-11);
        check_close(&found.acceleration, &ddq, 1e-10);
    }
}

#[test]
fn records_without_the_harmonics_are_told() {
    let [q, ..] = series(80);
    assert_eq!(differentiate(&q[..67], 40.0, 1.7, 5), Err(SignalError::TooShort { expected: 68, found: 67 }));
    assert!(matches!(differentiate(&q, 40.0, 1.7, 34), Err(SignalError::Setting { name: "harmonics", .. })));
    assert!(matches!(differentiate(&q, 40.0, 1.7, 60), Err(SignalError::TooShort { .. })));
    assert!(differentiate(&q, 0.0, 1.7, 2).is_err() && differentiate(&q, 40.0, f64::NAN, 2).is_err());
}

#[test]
fn periods_average_what_repeats() {
    // A first period that has not settled, then three whole ones and a part; the deviation of -1, 0, 1 is 1.
    let period: Vec<f64> = (0..10).map(|n| f64::from(n).sin()).collect();
    let mut signal = vec![9.0; 10];
    for shift in [-1.0, 0.0, 1.0] {
        signal.extend(period.iter().map(|x| x + shift));
    }
    signal.extend([77.0; 4]);
    let found = average_periods(&signal, 10, 1).unwrap();
    check_close(&found.mean, &period, 1e-15);
    assert_eq!(found.periods, 3);
    assert!((found.deviation.unwrap() - 1.0).abs() < 1e-14);
    assert_eq!(average_periods(&signal, 10, 3).unwrap().deviation, None);
    assert_eq!(average_periods(&signal, 10, 4), Err(SignalError::TooShort { expected: 50, found: 44 }));
    assert!(average_periods(&signal, 0, 0).is_err());
    assert!(average_periods(&[1.0, f64::INFINITY], 1, 0).is_err());
}
