//! Golden numbers of the source papers.

#![expect(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests")]

use std::path::Path;

use dynid_motion::filter::{butterworth, forward_backward};
use dynid_motion::trajectory::{Fourier, Point};
use serde_json::Value;

fn golden(name: &str) -> Option<Value> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/spec/golden").join(name);
    let Ok(text) = std::fs::read_to_string(path) else {
        println!("skipped: ../shared not present");
        return None;
    };
    Some(serde_json::from_str(&text).unwrap())
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

#[test]
fn indy7_filter() {
    let Some(golden) = golden("indy7_filter.json") else { return };
    let filter = butterworth(4, 10.0, 1000.0).unwrap();
    for (section, expected) in filter.as_slice().iter().zip(golden["sos"].as_array().unwrap()) {
        let found = [section.b.as_slice(), &[1.0], &section.a].concat();
        for (found, expected) in found.iter().zip(numbers(expected)) {
            assert!((found - expected).abs() <= 1e-12 * expected.abs(), "{found} {expected}");
        }
    }
    let output = forward_backward(&filter, &numbers(&golden["input"])).unwrap();
    let expected = numbers(&golden["output"]);
    let tolerance = golden["tolerance_abs"].as_f64().unwrap();
    let inside =
        golden["compare_from"].as_u64().unwrap() as usize..golden["compare_to"].as_u64().unwrap() as usize;
    for n in inside {
        assert!((output[n] - expected[n]).abs() < tolerance, "sample {n}");
    }
}

#[test]
fn indy7_trajectory() {
    let Some(golden) = golden("indy7_trajectory.json") else { return };
    let tolerance = golden["tolerance_abs"].as_f64().unwrap();
    let base = 0.1 * std::f64::consts::PI;
    for (joint, coefficients) in golden["coefficients"].as_array().unwrap().iter().enumerate() {
        let c = numbers(coefficients);
        let series = Fourier::velocity_amplitudes(base, c[0], &c[1..6], &c[6..11]).unwrap();
        for sample in golden["samples"].as_array().unwrap() {
            let Point { position, velocity, acceleration } = series.at(sample["t"].as_f64().unwrap());
            for (found, key) in [(position, "q"), (velocity, "qd"), (acceleration, "qdd")] {
                assert!((found - sample[key][joint].as_f64().unwrap()).abs() < tolerance, "{key}{joint}");
            }
        }
        let speed = (0..1000).map(|k| series.at(f64::from(k) * 0.02).velocity.abs()).fold(0.0, f64::max);
        assert!((speed - golden["max_abs_qd"][joint].as_f64().unwrap()).abs() < tolerance);
    }
}

#[test]
fn er16_trajectory() {
    let Some(golden) = golden("er16_trajectory.json") else { return };
    let reference = &golden["reference"];
    let tolerance = golden["tolerance_deg"].as_f64().unwrap();
    let base = std::f64::consts::TAU * 0.05;
    for (joint, coefficients) in reference["coefficients"].as_array().unwrap().iter().enumerate() {
        let c = numbers(coefficients);
        let series = Fourier::plain(base, c[0], c[1..6].to_vec(), c[6..11].to_vec()).unwrap();
        assert!((series.period() - 20.0).abs() < 1e-12);
        let points: Vec<Point> = (0..2000).map(|k| series.at(f64::from(k) * 0.01)).collect();
        let largest = |value: fn(&Point) -> f64| points.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        let found = [
            ("q_max_deg", largest(|p| p.position)),
            ("q_min_deg", -largest(|p| -p.position)),
            ("max_abs_qd_deg", largest(|p| p.velocity.abs())),
            ("max_abs_qdd_deg", largest(|p| p.acceleration.abs())),
        ];
        for (key, found) in found {
            let expected = reference[key][joint].as_f64().unwrap();
            assert!((found.to_degrees() - expected).abs() < tolerance, "{key} of joint {joint}: {found}");
        }
    }
}

#[test]
fn fourier_series_of_unequal_amplitudes_are_refused() {
    assert!(Fourier::plain(1.0, 0.0, vec![1.0], vec![]).is_err());
    assert!(Fourier::plain(0.0, 0.0, vec![], vec![]).is_err());
    assert!(Fourier::velocity_amplitudes(1.0, 0.0, &[f64::NAN], &[0.0]).is_err());
    let rest = Fourier::plain(1.0, 0.4, vec![], vec![]).unwrap().at(3.0);
    assert_eq!((rest.position, rest.velocity, rest.acceleration), (0.4, 0.0, 0.0));
}
